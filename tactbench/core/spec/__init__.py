"""Specifications of sensors, scenes, rigs, tasks and recordings, as frozen pydantic models."""
