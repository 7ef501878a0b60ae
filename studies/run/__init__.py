"""A study file carried out: batch by batch, on one machine or many, resumed where it was killed."""
