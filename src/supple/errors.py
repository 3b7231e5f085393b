"""The errors that Supple raises. Each text names the thing, what is wrong with it, and the remedy."""


class SuppleError(Exception):
    """Base of every error that Supple raises for bad input or an impossible request."""


class SuppleWarning(UserWarning):
    """A simulation ended early, or has frames that did not converge."""


class MeshError(SuppleError):
    """A surface or tetrahedral mesh, or a file that should hold one, cannot be used."""


class MeshingError(SuppleError):
    """Tetrahedralization failed, ran out of time or memory, or its input is not meshable."""


class SceneError(SuppleError):
    """A scene, or the file that describes it, is contradictory or incomplete."""


class SolverError(SuppleError):
    """A solver was given parameters, or a scene, that it cannot work with."""


class OutputError(SuppleError):
    """A recording, export or plot cannot be read or written."""


class StudyError(SuppleError):
    """A study, or the file that describes it, cannot be carried out."""


class CommandError(SuppleError):
    """A command to a running simulation is malformed, or asks for more than a live page allows."""
