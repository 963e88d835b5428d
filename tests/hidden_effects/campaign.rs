//! Runs many seeds of a family through the diagnosis, and counts how often it is right.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::time::Instant;

use rayon::prelude::*;
use serde_json::Value;

use super::oracle::Verdict;
use super::puzzle::{Family, Hidden, Puzzle};
use super::workshop;

/// The answer of the diagnosis to one puzzle.
#[derive(Clone, Debug, Default)]
pub(crate) struct GivenAnswer {
    outcome: String,
    /// Causes in the order of the answer.
    causes: Vec<AnsweredCause>,
    energy_removed: Option<f64>,
    /// Residual energy of the extended case above the noise, as a share of that of the baseline.
    left: f64,
    seconds: f64,
}

/// One cause of an answer, with its confidence, location and parameters.
#[derive(Clone, Debug)]
struct AnsweredCause {
    name: String,
    confidence: f64,
    /// Direction and channel of the cause, if the answer gives them.
    places: Vec<String>,
    /// Parameters by key, with their 90 % intervals.
    parameters: Vec<(String, [f64; 2])>,
}

/// True values of parameters, with the softening of a joint at the reference displacement of an answer, which is a scale
/// and no parameter.
fn at_reference_of(
    values: &[(&'static str, f64)],
    parameters: &[(String, [f64; 2])],
) -> Vec<(&'static str, f64)> {
    let of = |wanted: &str| {
        values
            .iter()
            .find(|(key, _)| *key == wanted)
            .map(|(_, value)| *value)
    };
    let answered = parameters.iter().find(|(key, _)| key == "reference_m");
    let (Some(reference_m), Some(exponent), Some((_, [answered_m, _]))) =
        (of("reference_m"), of("exponent"), answered)
    else {
        return values.to_vec();
    };
    let at = |(key, value): &(&'static str, f64)| match *key {
        "softening_n_per_m" => Some((*key, value * (answered_m / reference_m).powf(exponent))),
        "reference_m" => None,
        _ => Some((*key, *value)),
    };
    values.iter().filter_map(at).collect()
}

/// The puzzle of one seed with the answer and its assessment.
#[derive(Clone, Debug)]
pub(crate) struct Finding {
    seed: u64,
    hidden: Vec<&'static str>,
    verdict: Verdict,
    /// Root mean square of each effect over the noise, in the channel where it is largest.
    ratios: Vec<f64>,
    /// d² of the first effect, in cuts of a workshop.
    distance: f64,
    redrawn: usize,
    said: GivenAnswer,
    right: bool,
    /// True if the first cause of the answer is hidden. Of two effects, `right` requires both.
    first: bool,
    /// Among the parameters of rightly named causes: the number whose true value is in the interval, and the number of all.
    covered: [usize; 2],
    /// The parameters outside their interval: name and key, true value, interval.
    missed: Vec<String>,
}

impl GivenAnswer {
    /// Reads an answer in the form that `diagnose --json` prints.
    pub(crate) fn of(answer: &Value, seconds: f64) -> Self {
        let causes = answer["causes"].as_array().cloned().unwrap_or_default();
        Self {
            outcome: answer["outcome"].as_str().unwrap_or("(none)").into(),
            causes: causes
                .iter()
                .map(|cause| {
                    let parameters = cause["parameters"].as_object().cloned().unwrap_or_default();
                    let interval =
                        |value: &Value| [0, 1].map(|end| value["ci90"][end].as_f64().unwrap_or(f64::NAN));
                    AnsweredCause {
                        name: cause["name"].as_str().unwrap_or_default().to_owned(),
                        confidence: cause["confidence"].as_f64().unwrap_or(f64::NAN),
                        places: ["direction", "channel"]
                            .iter()
                            .filter_map(|key| Some(cause[key].as_str()?.to_owned()))
                            .collect(),
                        parameters: parameters
                            .iter()
                            .map(|(key, value)| (key.clone(), interval(value)))
                            .collect(),
                    }
                })
                .collect(),
            energy_removed: answer["gain"]["residual_energy_removed"].as_f64(),
            left: answer["unexplained"]["fraction"].as_f64().unwrap_or(f64::NAN),
            seconds,
        }
    }

    fn names(&self) -> BTreeSet<&str> {
        self.causes.iter().map(|cause| cause.name.as_str()).collect()
    }

    /// Label of the answer in the confusion matrix.
    fn label(&self) -> String {
        match self.outcome.as_str() {
            "cause" => self
                .causes
                .iter()
                .map(|cause| cause.name.as_str())
                .collect::<Vec<_>>()
                .join("+"),
            "confounded" => format!("{{{}}}", self.names().into_iter().collect::<Vec<_>>().join(" ")),
            other => other.into(),
        }
    }
}

impl AnsweredCause {
    /// True if the cause is one of the hidden ones. A direction or channel in the answer must be the hidden one. Of sensor errors, the set
    /// of channels in `all` causes of this name must be the hidden set.
    fn is_any_of(&self, hidden: &[Hidden], all: &[Self]) -> bool {
        hidden.iter().any(|hidden| {
            if hidden.name != self.name {
                return false;
            }
            if self.name.starts_with("sensor-") {
                let alike = all.iter().filter(|cause| cause.name == self.name);
                let said: BTreeSet<&String> = alike.flat_map(|cause| &cause.places).collect();
                // An answer without channel means all channels of motion.
                let is_of_all = said.is_empty() && hidden.places.len() > 1;
                return is_of_all || said == hidden.places.iter().collect();
            }
            let placed = self.places.iter().any(|place| hidden.places.contains(place));
            placed || self.places.is_empty() || hidden.places.is_empty()
        })
    }
}

impl Finding {
    /// Diagnoses a puzzle with `tool` and assesses the answer.
    pub(crate) fn of(puzzle: &Puzzle, tool: &(dyn Fn(&Puzzle) -> Value + Sync)) -> Self {
        let began = Instant::now();
        let said = GivenAnswer::of(&tool(puzzle), began.elapsed().as_secs_f64());
        let hidden: Vec<&'static str> = puzzle.hidden.iter().map(|hidden| hidden.name).collect();
        let wanted: BTreeSet<&str> = hidden.iter().copied().collect();
        let first = said.outcome == "cause"
            && said
                .causes
                .first()
                .is_some_and(|cause| cause.is_any_of(&puzzle.hidden, &said.causes));
        let right = match (&puzzle.verdict, puzzle.family) {
            (_, Family::NotInLibrary) => said.outcome == "unexplained",
            (Verdict::Invisible, Family::CuttingInWorkshop | Family::NothingInWorkshop) => {
                matches!(&said.outcome[..], "none" | "update")
            }
            (Verdict::Invisible, _) => said.outcome == "none",
            // A further false cause is a wrong answer.
            (Verdict::Separable, Family::CuttingInWorkshop) => {
                first
                    && said
                        .causes
                        .iter()
                        .all(|cause| cause.is_any_of(&puzzle.hidden, &said.causes))
            }
            (Verdict::Equivalent(set), _) => said.outcome == "confounded" && said.names() == *set,
            (_, Family::TwoEffects) => {
                let both = said
                    .causes
                    .iter()
                    .all(|cause| cause.is_any_of(&puzzle.hidden, &said.causes));
                said.outcome == "cause" && both && said.names() == wanted
            }
            _ => first,
        };
        let (mut covered, mut missed) = ([0, 0], Vec::new());
        if right && puzzle.verdict == Verdict::Separable {
            for AnsweredCause { name, parameters, .. } in &said.causes {
                for hidden in puzzle.hidden.iter().filter(|hidden| hidden.name == name) {
                    for (key, truth) in &at_reference_of(&hidden.values, parameters) {
                        let Some((_, [low, high])) = parameters.iter().find(|(known, _)| known == key) else {
                            continue;
                        };
                        covered[1] += 1;
                        // Angles are compared modulo 360 degrees.
                        let turn = if *key == "angle_deg" { 360.0 } else { 0.0 };
                        if [-turn, 0.0, turn]
                            .iter()
                            .any(|turn| (low..=high).contains(&&(truth + turn)))
                        {
                            covered[0] += 1;
                        } else {
                            missed.push(format!(
                                "{name}.{key} = {truth:.6e} not in [{low:.6e}, {high:.6e}]"
                            ));
                        }
                    }
                }
            }
        }
        Self {
            seed: puzzle.seed,
            hidden,
            verdict: puzzle.verdict.clone(),
            ratios: puzzle.ratios.clone(),
            distance: puzzle.hidden.first().map_or(0.0, |hidden| hidden.distance),
            redrawn: puzzle.redrawn,
            said,
            right,
            first,
            covered,
            missed,
        }
    }

    fn hidden_label(&self) -> String {
        match &self.verdict {
            _ if self.hidden.is_empty() => "nothing".into(),
            Verdict::Equivalent(set) => format!(
                "{} {{{}}}",
                self.hidden.join("+"),
                set.iter().copied().collect::<Vec<_>>().join(" ")
            ),
            Verdict::Borderline => format!("{} (grey)", self.hidden.join("+")),
            Verdict::Invisible => format!("{} (invisible)", self.hidden.join("+")),
            _ => self.hidden.join("+"),
        }
    }

    /// For a separable puzzle: true if every effect is larger than three times the noise. `None` for other puzzles.
    fn is_plain(&self) -> Option<bool> {
        (self.verdict == Verdict::Separable).then(|| self.ratios.iter().all(|ratio| *ratio > 3.0))
    }

    fn counts(&self) -> bool {
        self.verdict != Verdict::Borderline && self.is_plain() != Some(false)
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let confidence = self
            .said
            .causes
            .first()
            .map_or(f64::NAN, |cause| cause.confidence);
        write!(
            out,
            "seed {} {}: hidden {} at {}× noise, d² = {:.1}, said {} ({confidence:.3}, left {:.1e}, {:.2} s)",
            self.seed,
            if self.right { "right" } else { "WRONG" },
            self.hidden_label(),
            self.ratios
                .iter()
                .map(|ratio| format!("{ratio:.2}"))
                .collect::<Vec<_>>()
                .join(", "),
            self.distance,
            self.said.label(),
            self.said.left,
            self.said.seconds
        )?;
        self.missed
            .iter()
            .try_for_each(|missed| write!(out, "; {missed}"))
    }
}

/// Findings of all seeds of a family.
pub(crate) struct Report {
    pub(crate) family: Family,
    pub(crate) findings: Vec<Finding>,
}

impl Report {
    /// Runs the `seeds` of a family in parallel. The result does not depend on the number of threads.
    pub(crate) fn run(
        family: Family,
        seeds: std::ops::Range<u64>,
        tool: &(dyn Fn(&Puzzle) -> Value + Sync),
    ) -> Self {
        let of = |seed| {
            let finding = Finding::of(&workshop::draw(family, seed), tool);
            eprintln!("{} {finding}", family.name());
            finding
        };
        Self {
            family,
            findings: seeds.into_par_iter().map(of).collect(),
        }
    }

    fn share(&self, of: impl Fn(&Finding) -> Option<bool>) -> Share {
        let judged: Vec<bool> = self.findings.iter().filter_map(of).collect();
        Share {
            good: judged.iter().filter(|good| **good).count(),
            all: judged.len(),
        }
    }

    /// Share of right answers among separable puzzles in which every effect is larger than three times the noise.
    pub(crate) fn separable(&self) -> Share {
        self.share(|f| (f.is_plain() == Some(true)).then_some(f.right))
    }

    /// Share of answers whose first cause is hidden, among puzzles of two effects that are both larger than three times the noise.
    fn one_of_two_first(&self) -> Share {
        self.share(|f| (f.hidden.len() == 2 && f.is_plain() == Some(true)).then_some(f.first))
    }

    /// Share of answers with exactly the set of equivalent causes, among puzzles whose causes are equivalent.
    pub(crate) fn equivalent(&self) -> Share {
        self.share(|f| matches!(f.verdict, Verdict::Equivalent(_)).then_some(f.right))
    }

    /// Share of answers `none`, among puzzles whose records show no effect.
    pub(crate) fn invisible(&self) -> Share {
        self.share(|f| (f.verdict == Verdict::Invisible).then_some(f.right))
    }

    /// Share of right answers, among separable puzzles with an effect below three times the noise.
    pub(crate) fn weak(&self) -> Share {
        self.share(|f| (f.is_plain() == Some(false)).then_some(f.right))
    }

    /// Share of answers that are right or `none`, among separable puzzles with an effect below three times the noise.
    fn weak_not_wrong(&self) -> Share {
        self.share(|f| (f.is_plain() == Some(false)).then_some(f.right || f.said.outcome == "none"))
    }

    /// Share of true parameter values inside their 90 % intervals.
    pub(crate) fn covered(&self) -> Share {
        let sum = |index: usize| self.findings.iter().map(|f| f.covered[index]).sum();
        Share {
            good: sum(0),
            all: sum(1),
        }
    }

    /// Seeds whose answer contains the effect `name` although it is not hidden, with the hidden effects and the answer.
    pub(crate) fn naming(&self, name: &str) -> Vec<String> {
        let wrong = self
            .findings
            .iter()
            .filter(|f| f.said.names().contains(name) && !f.hidden.contains(&name));
        wrong
            .map(|f| format!("{}: {} said {}", f.seed, f.hidden_label(), f.said.label()))
            .collect()
    }

    /// Number of diagnoses that state an interval of a true parameter.
    pub(crate) fn with_intervals(&self) -> usize {
        self.findings.iter().filter(|f| f.covered[1] > 0).count()
    }

    /// Share of right answers, among answers that name a cause with a confidence of 0.9 or more.
    pub(crate) fn confident(&self) -> Share {
        self.share(|f| {
            let confidence = f
                .said
                .causes
                .first()
                .filter(|_| f.said.outcome == "cause")?
                .confidence;
            (confidence >= 0.9).then_some(f.right)
        })
    }

    /// Share of answers that remove at least 80 % of the held-out residual energy, among right answers to puzzles whose every effect is
    /// larger than three times the noise.
    pub(crate) fn energy(&self) -> Share {
        self.share(|f| {
            let named = f.said.outcome == "cause" && f.right && f.is_plain() == Some(true);
            named.then(|| f.said.energy_removed.is_some_and(|share| share >= 0.8))
        })
    }
}

/// A number of good cases among all cases.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Share {
    pub(crate) good: usize,
    pub(crate) all: usize,
}

impl Share {
    /// Sum of two shares: good cases and all cases added.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            good: self.good + other.good,
            all: self.all + other.all,
        }
    }

    /// Good cases over all cases; 1 if there are none.
    pub(crate) fn value(self) -> f64 {
        if self.all == 0 {
            1.0
        } else {
            self.good as f64 / self.all as f64
        }
    }
}

impl fmt::Display for Share {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{:5.1} % of {}", 100.0 * self.value(), self.all)
    }
}

impl Report {
    /// The shares of the family, with their names.
    fn shares(&self) -> [(&'static str, Share); 9] {
        [
            ("right, separable and above 3× noise", self.separable()),
            ("one of the two first, the same", self.one_of_two_first()),
            ("exact set, equivalent", self.equivalent()),
            ("none, nothing to be seen", self.invisible()),
            ("right, separable and below 3× noise", self.weak()),
            ("right or none, the same", self.weak_not_wrong()),
            ("truth in the 90 % interval", self.covered()),
            ("right of those with confidence ≥ 0.9", self.confident()),
            ("energy cut by ≥ 80 %", self.energy()),
        ]
    }

    /// The shares of the family that have cases, as figures of the campaign.
    pub(crate) fn figures(&self) -> Vec<(String, String)> {
        let shares = self.shares().into_iter().filter(|(_, share)| share.all > 0);
        shares
            .map(|(what, share)| {
                (
                    format!("{}: {what}", self.family.name()),
                    share.to_string().trim().to_owned(),
                )
            })
            .collect()
    }
}

impl fmt::Display for Report {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(out, "== {}: {} seeds", self.family.name(), self.findings.len())?;
        let mut matrix: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
        for finding in self.findings.iter().filter(|finding| finding.counts()) {
            *matrix
                .entry(finding.hidden_label())
                .or_default()
                .entry(finding.said.label())
                .or_default() += 1;
        }
        for (hidden, said) in matrix {
            let said: Vec<String> = said
                .iter()
                .map(|(said, count)| format!("{said} {count}"))
                .collect();
            writeln!(out, "  {hidden}: {}", said.join(", "))?;
        }
        for finding in self
            .findings
            .iter()
            .filter(|f| (!f.right && f.counts()) || !f.missed.is_empty())
        {
            writeln!(out, "  {finding}")?;
        }
        for (what, share) in self.shares() {
            if share.all > 0 {
                writeln!(out, "  {what}: {share}")?;
            }
        }
        let redrawn: usize = self.findings.iter().map(|finding| finding.redrawn).sum();
        let longest = self
            .findings
            .iter()
            .map(|finding| finding.said.seconds)
            .fold(0.0, f64::max);
        writeln!(
            out,
            "  drawn again: {redrawn}; longest diagnosis, beside others, {longest:.2} s"
        )
    }
}
