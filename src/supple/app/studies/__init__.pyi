"""The public names of `supple.studies` and their modules."""

from .designs import Grid as Grid
from .designs import LatinHypercube as LatinHypercube
from .designs import OneAtATime as OneAtATime
from .designs import Paired as Paired
from .designs import Sobol as Sobol
from .factors import loguniform as loguniform
from .factors import uniform as uniform
from .plots import plot_study as plot_study
from .study_file import load_study as load_study
from .sweep import sweep as sweep
from .table import StudyTable as StudyTable
