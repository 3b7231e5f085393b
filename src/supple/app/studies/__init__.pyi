"""The public names of `supple.studies` and their modules."""

from .factors import Factor as Factor
from .factors import Grid as Grid
from .factors import LatinHypercube as LatinHypercube
from .factors import loguniform as loguniform
from .factors import uniform as uniform
from .study import sweep as sweep
from .study_file import load_study as load_study
from .table import StudyTable as StudyTable
