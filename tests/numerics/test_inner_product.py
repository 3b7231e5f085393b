import math

import numpy as np
import pytest

from supple.numerics.inner_product import inner, norm


def test_inner_product_and_norm_are_sums_over_all_entries():
    a, b = np.random.default_rng(0).normal(size=(2, 5000, 3))
    assert inner(a, b) == pytest.approx(math.fsum((a * b).ravel()), abs=1e-10)
    assert norm(a) == pytest.approx(math.sqrt(math.fsum((a * a).ravel())), rel=1e-14)
    assert inner(np.zeros((0, 3)), np.zeros((0, 3))) == 0.0
