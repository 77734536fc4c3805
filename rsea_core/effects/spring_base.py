"""What effects of the spring have in common."""

N_ELEMENTS, N_BRANCHES = 6, 3


NEEDS_SPRING = "needs a spring between wheel and load"
