"""How XPBD answers a contact: push-out and friction."""
