"""MJCF in and out: written for people, read with checks, compared, edited."""
