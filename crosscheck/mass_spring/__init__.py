"""Mass-spring systems: our forces, steps, motions and rests beside MuJoCo's and closed forms."""
