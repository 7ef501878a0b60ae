"""Which class of controllers is best at equal effort, and what of it holds elsewhere?"""
