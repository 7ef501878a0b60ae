"""EXUDYN's beam as a plant: another author's elements, joints and integrator."""
