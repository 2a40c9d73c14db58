"""What the twin is checked against: laws, closed forms, and independent calculations."""
