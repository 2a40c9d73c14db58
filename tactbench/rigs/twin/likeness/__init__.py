"""The twin, or anybody's recordings, held against figures of real units (see ``docs/likeness.md``)."""
