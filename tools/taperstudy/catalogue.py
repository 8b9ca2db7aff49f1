"""All sections, in the order of the report."""

from .beyond import topics
from .model import Section
from .paper import experiments, paper_figures
from .recipes import Inputs
from .sensitivity import batteries, horizons, lambdas, limits, outer_iterations, weeks

QUICK = ("paper", "figures")


def all_sections(inputs: Inputs) -> list[Section]:
    return [experiments(), paper_figures(), lambdas(), horizons(), outer_iterations(), batteries(), limits(), weeks(inputs),
            *(topic.section() for topic in topics())]
