"""Reading and writing feeder files: fields, checks, messages."""
