"""Running a study: specification, draws, engine, store."""
