"""A device beside a model of it, taken through random steps until they differ."""
