"""The arm on its curve and cloths beside each other, to be played in a browser."""
