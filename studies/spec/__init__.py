"""The study file: what a study is made of, read, checked and written."""
