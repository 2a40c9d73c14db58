"""The report: tables and figures as in the paper, and one HTML page with all of these, from stored results."""
