"""Surfaces as the contact library sees them."""
