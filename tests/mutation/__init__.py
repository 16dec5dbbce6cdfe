"""Faults planted in the operators, one at a time: do the tests find every one?"""
