"""The leaderboard as one HTML file: tables, matrix, score against time, and every cell behind its numbers."""
