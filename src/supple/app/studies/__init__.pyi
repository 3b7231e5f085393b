"""The public names of `supple.studies` and their modules."""

from .designs import Grid as Grid
from .designs import LatinHypercube as LatinHypercube
from .factors import Factor as Factor
from .factors import loguniform as loguniform
from .factors import uniform as uniform
from .study_file import load_study as load_study
from .sweep import sweep as sweep
from .table import StudyTable as StudyTable
