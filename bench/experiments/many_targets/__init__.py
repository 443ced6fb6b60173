"""As many targets for an arm as are asked for, in parts: how rare are failures?"""
