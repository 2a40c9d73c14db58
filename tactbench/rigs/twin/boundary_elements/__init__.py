"""Boundary elements: the rung of the contact ladder that the others are held against (see ``docs/contact.md``)."""
