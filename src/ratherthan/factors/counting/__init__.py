"""Choices of a large model enter, what their search trees weigh leaves: several exact methods under one budget of work."""
