"""Offline half: solves the full model, lays the blocks, writes and verifies the table."""
