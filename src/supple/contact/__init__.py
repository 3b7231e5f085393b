"""Contact of surfaces, for both solvers: it knows neither."""
