"""Speed against accuracy on the real assets: ``python -m bench.tradeoff [--repeats N] [--quick]``.

Sweeps five of them as ``occluder tradeoff`` does, each with its own ground and up axis, and writes

    bench/results/tradeoff_NAME.csv   the rows of each (docs/tradeoff.md names the columns)
    docs/images/tradeoff_NAME.png     its fronts
    docs/tradeoff.md                  the part between the marks, tables and advice; the rest stays

``--quick``  a budget, two values a knob: to try the command, not to keep its figures.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from bench.machine import ROOT, header
from bench.meshes import STAND_INS, StandIn
from simplifier.options.tradeoff import TradeoffOptions
from simplifier.tradeoff import words
from simplifier.tradeoff.advice import Advice, advise
from simplifier.tradeoff.cases import Case
from simplifier.tradeoff.plot import overview_picture
from simplifier.tradeoff.study import Study, study_of
from simplifier.tradeoff.sweep import sweep
from simplifier.tradeoff.table import tradeoff_csv
from simplifier.warmup import warm_up
from simplifier.wording import median_points, percent, short_seconds

RESULTS, DOCS = ROOT / "bench" / "results", ROOT / "docs"
BEGIN, END = "<!-- measured: begin -->", "<!-- measured: end -->"
PRECISION = 0.99

_QUICK = TradeoffOptions(
    resolutions=(32,), directions=(16,), budgets=(16,), times=(0.25, 1.0), repeats=1
)


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description="Speed against accuracy on the real assets.")
    parser.add_argument("--repeats", type=int, default=3, help="runs a setting")
    parser.add_argument("--quick", action="store_true", help="a small sweep, to try the command")
    arguments = parser.parse_args()
    quick = " --quick" if arguments.quick else ""
    command = f"python -m bench.tradeoff --repeats {arguments.repeats}{quick}"
    base = replace(_QUICK if quick else TradeoffOptions(), repeats=arguments.repeats)
    warm_up()
    measure([stand_in for stand_in in STAND_INS if not stand_in.missing], base, command)


def measure(stand_ins: Sequence[StandIn], base: TradeoffOptions, command: str) -> None:
    """Sweep, and write all files."""
    studies = {}
    for stand_in in stand_ins:
        print(f"{stand_in.name} ...", flush=True)
        studies[stand_in] = studied(stand_in, base)
        write_study(stand_in, studies[stand_in], command)
    write_measured(DOCS / "tradeoff.md", measured(studies, command))


def studied(stand_in: StandIn, base: TradeoffOptions) -> Study:
    """The sweep of one asset."""
    options = replace(base, up=stand_in.up, ground=stand_in.ground)
    return study_of(list(sweep([stand_in.path], options)), options, PRECISION)


def write_study(stand_in: StandIn, study: Study, command: str) -> None:
    """The rows and the picture of one asset."""
    table = tradeoff_csv(study.outcomes, study.cases, study.options, study.machine)
    (RESULTS / f"tradeoff_{stand_in.name}.csv").write_bytes(table)
    footer = "; ".join(header(command)[:2])
    picture = overview_picture(study.cases, study.precision, footer)
    (DOCS / "images" / f"tradeoff_{stand_in.name}.png").write_bytes(picture)


def measured(studies: dict[StandIn, Study], command: str) -> str:
    """The generated part of the page, as Markdown."""
    cases = [case for study in studies.values() for case in study.cases]
    advice = advise(cases)
    lines = [f"- {line}" for line in header(command)]
    lines += ["", "### Which knob first", "", *_knob_table(advice), ""]
    lines += [f"- {line}" for line in words.advice_lines(advice)]
    lines += ["", "### Which settings pay", "", *_pay_table(advice), ""]
    lines += [f"- {line}" for line in words.never_lines(advice, PRECISION)]
    for stand_in, study in studies.items():
        lines += ["", *_mesh_section(stand_in, study)]
    return "\n".join(lines)


def write_measured(page: Path, text: str) -> None:
    """Replace what stands between the marks of the page."""
    before, _, rest = page.read_text("utf-8").partition(BEGIN)
    _, _, after = rest.partition(END)
    page.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{after}", encoding="utf-8")


def _knob_table(advice: Advice) -> Iterator[str]:
    yield "| knob | slower: points a doubling of time | faster: points a halving | as fast |"
    yield "|---|---|---|---|"
    for knob in advice.by_gain:
        slower = [step.per_doubling for step in knob.slower]
        faster = [-step.per_doubling for step in knob.faster]
        cells = [_spread(values) for values in (slower, faster, [s.gain for s in knob.level])]
        yield f"| {knob.knob} | {' | '.join(cells)} |"


def _spread(values: Sequence[float]) -> str:
    steps = f"{len(values)} step{'' if len(values) == 1 else 's'}"
    return f"{median_points(values)}, {steps}" if values else ""


def _pay_table(advice: Advice) -> Iterator[str]:
    yield "| setting | on the front | else dominated most often by |"
    yield "|---|---|---|"
    for pay in advice.pays:
        yield f"| {pay.value} | {pay.paid} of {pay.cases} | {', '.join(pay.rivals[:2])} |"


def _mesh_section(stand_in: StandIn, study: Study) -> Iterator[str]:
    ground = f", standing on the ground, up {stand_in.up}" if stand_in.ground else ""
    yield f"### {stand_in.file}{ground}"
    yield ""
    yield f"![Time against recall, {stand_in.name}](images/tradeoff_{stand_in.name}.png)"
    yield ""
    yield from (f"- {line}" for line in study.warnings)
    yield ""
    budgets = " | ".join(f"budget {case.budget}" for case in study.cases)
    yield f"| setting | {budgets} |"
    yield "|---" * (len(study.cases) + 1) + "|"
    for name in dict.fromkeys(item.setting.name for case in study.cases for item in case.judged):
        yield f"| {name} | {' | '.join(_cell(case, name) for case in study.cases)} |"


def _cell(case: Case, name: str) -> str:
    """Time and recall, bold on the front; the precision where it is too low."""
    item = next((item for item in case.judged if item.setting.name == name), None)
    if item is None or item.verdict == "failed":
        return "no result"
    told = f"{short_seconds(item.seconds)}, {percent(item.recall)}"
    if item.verdict == "imprecise":
        return f"*{told} at {percent(item.precision, 2)}*"
    return f"**{told}**" if item.verdict == "front" else told


if __name__ == "__main__":
    main()
