"""Answers that the dataclasses of the library declare: JSON, schemas, and the fields of every
answer.
"""
