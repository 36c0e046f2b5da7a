"""The nouns: Problem, MDP, Policy, Objective and its kinds, World, Lexicon; and the graph kernels."""
