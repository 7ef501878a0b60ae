"""What a study file says: read with care, resolved to plain numbers, built into what runs."""
