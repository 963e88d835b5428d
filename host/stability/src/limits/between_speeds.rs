//! Stability limits at further spindle speeds of a chart, so that straight lines between neighbouring speeds draw the
//! limits. A line of the chart ([`SpeedLine`]) holds the limits at one spindle speed.
//!
//! A gap between two neighbouring speeds is accepted if the straight line over it between the ends of each stable depth
//! interval is right to [`CHART_DEPTH`] of the depth, or to [`CHART_SPEED`] of the speed where a limit is steep. The
//! error of the straight line over a gap follows from the two neighbouring gaps. Extrapolation of the limit from the
//! left neighbour to the right end of the gap misses by e_r, from the right neighbour to the left end by e_l. A kink
//! within the gap, where two lobes meet, then lies
//!
//!   e_r e_l/(e_r + e_l)
//!
//! off the straight line, wherever in the gap it is; a parabola over equal gaps lies off by a quarter of that. Limits whose
//! chatter frequencies do not jump by [`ONE_LOBE`] of a vibration in a tooth period lie on one lobe, which has no kink:
//! for them [`PARABOLA_MARGIN`] times the error of the parabola is taken. If the stable intervals of two neighbouring
//! speeds differ in number, the gap is halved, down to the width [`CHART_SPEED`].
//!
//! A region of stability or of chatter that lies within one gap changes no limit at either end. It is found from the
//! largest Floquet multiplier (characteristic multiplier) |μ|: at each step in depth, the same extrapolations of ln|μ|
//! estimate its extremum within the gap. A gap in which |μ| may cross 1 and return is halved as well. All this requires
//! speeds that are close compared with the lobes, which repeat when the number of vibrations in a tooth period changes
//! by one: gaps are first divided so that each lobe has [`LINES_OF_LOBE`] lines, and so that none is wider than
//! [`CHART_GAP`]. Two lightly damped modes whose frequencies add up to a multiple of the tooth-passing frequency become
//! unstable in a narrow tongue, which may end within a gap. The line at a speed beside the tongue shows a maximum of
//! |μ| over the depth: a gap beside such a speed is halved down to [`TONGUE_GAP`].
//!
//! Lobe tables are refined by another rule, [`Chart::refined`]; the head of its file says why.

use super::chart::{Chart, chart};
use super::islands::narrowest_island_rpm;
use super::method::Method;
use super::resolution::Resolution;
use super::speed_line::{SpeedLine, Switch};
use crate::criteria::{
    CHART_DEPTH, CHART_GAP, CHART_LINES_MAX, CHART_SAMPLES_MIN, CHART_SPEED, LINES_OF_LOBE, ONE_LOBE,
    PARABOLA_MARGIN, TONGUE_GAP,
};
use crate::error::StabilityError;
use crate::spectrum::verdict::Verdict;

impl Chart {
    /// Adds limits at further spindle speeds until straight lines between neighbouring speeds draw the limits, until
    /// the remaining gaps are at most `CHART_SPEED` wide, or until a further round would exceed `CHART_LINES_MAX` added
    /// speeds: see [`Resolution`].
    ///
    /// `samples` is the number of steps in depth of the limits at the requested speeds, `teeth` the number of teeth of
    /// the tool. The result does not depend on the number of threads.
    ///
    /// # Errors
    /// As [`Method::line`], for the first speed that fails.
    pub fn with_lines_between<M: Method + ?Sized>(
        mut self,
        method: &M,
        depth_mm: f64,
        samples: usize,
        teeth: usize,
    ) -> Result<Self, StabilityError> {
        let mut lines: Vec<SpeedLine> = self.speeds.clone();
        lines.sort_by(|a, b| a.rpm.total_cmp(&b.rpm));
        lines.dedup_by(|a, b| a.rpm == b.rpm);
        let asked = lines.len();
        // Added speeds have at most as many steps in depth as the requested ones. Their sampled depths are sampled
        // depths of the requested speeds too, so that |μ| of both can be compared.
        let stride = stride(samples);
        for line in &mut lines {
            line.largest = line.largest.iter().step_by(stride).copied().collect();
        }
        loop {
            let further: Vec<f64> = (1..lines.len())
                .flat_map(|right| speeds_within(&lines, right, teeth))
                .collect();
            if further.is_empty() || lines.len() - asked + further.len() > CHART_LINES_MAX {
                break;
            }
            let between = chart(method, &further, depth_mm, samples / stride)?.speeds;
            self.refined.extend(between.iter().cloned());
            lines.extend(between);
            lines.sort_by(|a, b| a.rpm.total_cmp(&b.rpm));
        }
        self.refined.sort_by(|a, b| a.rpm.total_cmp(&b.rpm));
        self.resolution = Some(Resolution {
            depth_share: CHART_DEPTH,
            speed_share: CHART_SPEED,
            narrowest_island_rpm: narrowest_island_rpm(&lines, depth_mm),
            unresolved_rpm: (1..lines.len())
                .filter(|&right| !is_drawn(&lines, right, teeth))
                .map(|right| [lines[right - 1].rpm, lines[right].rpm])
                .collect(),
        });
        Ok(self)
    }

    /// Verdict that the chart draws at a spindle speed and an axial depth, from the straight lines between the two
    /// neighbouring speeds. Over an unresolved gap, or where the stable intervals differ in number, it is the verdict
    /// at both speeds if they agree, otherwise `Undecided`. `None` outside the speeds of the chart.
    pub fn verdict(&self, rpm: f64, depth_mm: f64) -> Option<Verdict> {
        let lines = self.lines();
        let right = lines.partition_point(|line| line.rpm < rpm);
        let line = lines.get(right)?;
        if line.rpm == rpm {
            return Some(verdict_of(contains(&line.stable_mm, depth_mm)));
        }
        let left = lines.get(right.checked_sub(1)?)?;
        let unresolved = self
            .resolution
            .iter()
            .flat_map(|resolution| &resolution.unresolved_rpm);
        let is_resolved = unresolved.clone().all(|gap| *gap != [left.rpm, line.rpm]);
        if is_resolved && left.stable_mm.len() == line.stable_mm.len() {
            let share = (rpm - left.rpm) / (line.rpm - left.rpm);
            let between = left.stable_mm.iter().zip(&line.stable_mm);
            let mut intervals = between.map(|(a, b)| [0, 1].map(|end| a[end] + (b[end] - a[end]) * share));
            return Some(verdict_of(
                intervals.any(|interval| contains(&[interval], depth_mm)),
            ));
        }
        let ends = [left, line].map(|line| contains(&line.stable_mm, depth_mm));
        Some(if ends[0] == ends[1] {
            verdict_of(ends[0])
        } else {
            Verdict::Undecided
        })
    }

    /// Limits at all spindle speeds of the chart, requested and added, by ascending speed.
    pub fn lines(&self) -> Vec<&SpeedLine> {
        let mut lines: Vec<&SpeedLine> = self.speeds.iter().chain(&self.refined).collect();
        lines.sort_by(|a, b| a.rpm.total_cmp(&b.rpm));
        lines
    }
}

/// Largest divisor d of the number `samples` of steps in depth for which `samples`/d is at least [`CHART_SAMPLES_MIN`];
/// 1 if there is none.
fn stride(samples: usize) -> usize {
    (1..=samples / CHART_SAMPLES_MIN)
        .rev()
        .find(|divisor| samples.is_multiple_of(*divisor))
        .unwrap_or(1)
}

fn verdict_of(is_stable: bool) -> Verdict {
    if is_stable {
        Verdict::Stable
    } else {
        Verdict::Unstable
    }
}

fn contains(intervals: &[[f64; 2]], depth_mm: f64) -> bool {
    intervals
        .iter()
        .any(|[from, to]| (*from..=*to).contains(&depth_mm))
}

/// Spindle speeds at which the gap below the speed with index `right` is to be divided, rev/min, ascending; none if
/// [`is_drawn`] holds and the gap is no wider than [`coarsest`], or if its relative width is at most [`CHART_SPEED`].
fn speeds_within(lines: &[SpeedLine], right: usize, teeth: usize) -> Vec<f64> {
    let (left, right_line) = (&lines[right - 1], &lines[right]);
    let width = right_line.rpm / left.rpm - 1.0;
    if width <= CHART_SPEED {
        return Vec::new();
    }
    let parts = (width / coarsest(left, right_line, teeth)).ceil();
    let parts = if parts > 1.0 {
        parts
    } else if is_drawn(lines, right, teeth) {
        return Vec::new();
    } else {
        2.0
    };
    // The parts of the gap are at least half as wide as [`CHART_SPEED`], which bounds their number.
    let parts = parts.min((width / CHART_SPEED).ceil()) as usize;
    let step_rpm = (right_line.rpm - left.rpm) / parts as f64;
    (1..parts).map(|part| left.rpm + step_rpm * part as f64).collect()
}

/// Widest relative gap between two speeds, at most [`CHART_GAP`], at which every lobe has [`LINES_OF_LOBE`] speeds.
/// Lobes repeat in speed by 1/k of the speed, with k vibrations in a tooth period; the fastest chatter at an end of a
/// stable interval at either speed sets k.
fn coarsest(left: &SpeedLine, right: &SpeedLine, teeth: usize) -> f64 {
    let vibrations = |line: &SpeedLine| {
        let ends = line.stable_mm.iter().flatten();
        let counts = ends.filter_map(|end_mm| vibrations(line, line.switch_at(*end_mm)?, teeth));
        counts.fold(0.0, f64::max)
    };
    (1.0 / (LINES_OF_LOBE * vibrations(left).max(vibrations(right)))).min(CHART_GAP)
}

/// Number of vibrations in a tooth period at a limit; `None` if the chatter frequency is not known.
fn vibrations(line: &SpeedLine, switch: &Switch, teeth: usize) -> Option<f64> {
    Some(switch.chatter_hz? * 60.0 / (line.rpm * teeth.max(1) as f64))
}

/// True if straight lines over the gap below the speed with index `right` draw every stable depth interval, and if no
/// sign shows of a region of stability or of chatter within the gap.
fn is_drawn(lines: &[SpeedLine], right: usize, teeth: usize) -> bool {
    let gap = Gap::below(lines, right, teeth);
    gap.is_straight() && !gap.may_hide_a_region() && !gap.may_hide_a_tongue()
}

/// Gap between two neighbouring speeds of a chart: the limits at both of them, and at the next speeds on either side,
/// `None` at the ends of the chart.
struct Gap<'a> {
    before: Option<&'a SpeedLine>,
    left: &'a SpeedLine,
    right: &'a SpeedLine,
    after: Option<&'a SpeedLine>,
    teeth: usize,
}

impl<'a> Gap<'a> {
    /// Gap below the speed with index `right`, at least 1.
    fn below(lines: &'a [SpeedLine], right: usize, teeth: usize) -> Self {
        Self {
            before: right.checked_sub(2).map(|index| &lines[index]),
            left: &lines[right - 1],
            right: &lines[right],
            after: lines.get(right + 1),
            teeth,
        }
    }

    /// True if both speeds have the same number of stable depth intervals, and if the straight line over the gap
    /// between the ends of each interval is right to [`CHART_DEPTH`] of the depth or to [`CHART_SPEED`] of the speed by
    /// the estimated error. Without an estimate both ends must be equal.
    fn is_straight(&self) -> bool {
        self.has_equal_counts() && self.ends_of_intervals().all(|end| self.excess(end) <= 1.0)
    }

    fn has_equal_counts(&self) -> bool {
        self.left.stable_mm.len() == self.right.stable_mm.len()
    }

    /// Ends of the stable depth intervals, [interval, end].
    fn ends_of_intervals(&self) -> impl Iterator<Item = [usize; 2]> {
        (0..self.left.stable_mm.len()).flat_map(|interval| [[interval, 0], [interval, 1]])
    }

    /// Prediction errors of a quantity of the limit that ends a stable interval; see [`misses`](Self::misses). A
    /// neighbouring speed with another number of intervals gives none.
    fn misses_of(
        &self,
        [interval, end]: [usize; 2],
        quantity: impl Fn(&SpeedLine, f64) -> Option<f64>,
    ) -> [Option<f64>; 2] {
        let count = self.left.stable_mm.len();
        let of = |line: &SpeedLine| quantity(line, line.stable_mm.get(interval)?[end]);
        let beyond =
            |line: Option<&SpeedLine>| line.filter(|line| line.stable_mm.len() == count).and_then(of);
        match (of(self.left), of(self.right)) {
            (Some(left), Some(right)) => self.misses(beyond(self.before), left, right, beyond(self.after)),
            _ => [None, None],
        }
    }

    /// Estimated error of the straight line over the gap for the limit that ends a stable interval, as a share of what
    /// is accepted. Without an estimate it is 0 if the limit is the same at both speeds, infinite otherwise.
    fn excess(&self, interval_end: [usize; 2]) -> f64 {
        let [interval, end] = interval_end;
        let [a, b] = [self.left, self.right].map(|line| line.stable_mm[interval][end]);
        let misses = self.misses_of(interval_end, |_, depth_mm| Some(depth_mm));
        let Some(kink_mm) = kink_between(misses) else {
            return if a == b { 0.0 } else { f64::INFINITY };
        };
        let on_lobe = self.misses_on_lobe(interval_end, misses);
        let parabola_mm = on_lobe.and_then(|misses| self.parabola(misses));
        let error_mm = parabola_mm.map_or(kink_mm, |parabola_mm| kink_mm.min(PARABOLA_MARGIN * parabola_mm));
        let steep_mm = CHART_SPEED * self.left.rpm * (b - a).abs() / (self.right.rpm - self.left.rpm);
        let accepted_mm = (CHART_DEPTH * a.min(b)).max(steep_mm);
        if error_mm > 0.0 {
            error_mm / accepted_mm
        } else {
            0.0
        }
    }

    /// True if the limits that end this stable interval at two neighbouring speeds lie on one lobe: they are of one kind,
    /// and the change of the chatter frequency is less than [`ONE_LOBE`] of a vibration in a tooth period.
    fn are_of_one_lobe(&self, [interval, end]: [usize; 2], lower: &SpeedLine, upper: &SpeedLine) -> bool {
        let switch = |line: &SpeedLine| {
            let switch = line.switch_at(line.stable_mm.get(interval)?[end])?;
            Some((switch.kind, vibrations(line, switch, self.teeth)?))
        };
        let (Some((kind, low)), Some((other_kind, high))) = (switch(lower), switch(upper)) else {
            return false;
        };
        kind == other_kind && (high * upper.rpm / lower.rpm - low).abs() < ONE_LOBE
    }

    /// Prediction errors of a limit from the speeds on the same lobe; `None` if the limits at both ends of the gap lie on
    /// different lobes.
    fn misses_on_lobe(&self, interval_end: [usize; 2], misses: [Option<f64>; 2]) -> Option<[Option<f64>; 2]> {
        let is_linked = |lower, upper| self.are_of_one_lobe(interval_end, lower, upper);
        let before = self.before.is_some_and(|before| is_linked(before, self.left));
        let after = self.after.is_some_and(|after| is_linked(self.right, after));
        is_linked(self.left, self.right)
            .then_some([misses[0].filter(|_| before), misses[1].filter(|_| after)])
    }

    /// Largest distance of a smooth curve from its chord over the gap, from its prediction errors: that of the parabola
    /// through the gap and the next speed on one side, of the more bent one if both errors are known. `None` if neither
    /// is.
    fn parabola(&self, [right, left]: [Option<f64>; 2]) -> Option<f64> {
        let width = self.right.rpm - self.left.rpm;
        // The parabola c x² misses by c h (h + h′), with the widths h of the gap and h′ of the next one, and lies c h²/4
        // off its chord.
        let by = |miss: f64, next: f64| 0.25 * miss.abs() * width / (width + next);
        let before = self
            .before
            .zip(right)
            .map(|(line, miss)| by(miss, self.left.rpm - line.rpm));
        let after = self
            .after
            .zip(left)
            .map(|(line, miss)| by(miss, line.rpm - self.right.rpm));
        before.into_iter().chain(after).reduce(f64::max)
    }

    /// Prediction errors of linear extrapolation at both ends of the gap: (right end, left end). Each is the value of a
    /// limit, or of ln|μ|, at that end less the value of the straight line through the other end and the next speed
    /// beyond that other end; `None` without a value at that next speed.
    fn misses(&self, before: Option<f64>, left: f64, right: f64, after: Option<f64>) -> [Option<f64>; 2] {
        let width = self.right.rpm - self.left.rpm;
        let at_right = self.before.zip(before).map(|(line, value)| {
            let slope = (left - value) / (self.left.rpm - line.rpm);
            right - (left + slope * width)
        });
        let at_left = self.after.zip(after).map(|(line, value)| {
            let slope = (value - right) / (line.rpm - self.right.rpm);
            left - (right - slope * width)
        });
        [at_right, at_left]
    }

    /// True if the largest multiplier may cross the unit circle and return within the gap between two speeds, at a step
    /// in depth where it lies on one side of the circle at both speeds.
    fn may_hide_a_region(&self) -> bool {
        let (left, right) = (&self.left.largest, &self.right.largest);
        let steps = left.len().min(right.len());
        (0..steps).any(|step| {
            let log = |line: &SpeedLine| line.largest.get(step).map(|size| logarithm(*size));
            let (Some(a), Some(b)) = (log(self.left), log(self.right)) else {
                return false;
            };
            if (a > 0.0) != (b > 0.0) {
                return false;
            }
            let side = if a > 0.0 { 1.0 } else { -1.0 };
            // If |μ| bends towards the unit circle within the gap, |μ| at each end lies farther from the circle than
            // the extrapolation predicts.
            let misses = self.misses(self.before.and_then(log), a, b, self.after.and_then(log));
            let misses = misses.map(|miss| miss.map(|miss| (side * miss).max(0.0)));
            let Some(kink) = kink_between(misses) else {
                return false;
            };
            // Where two multipliers exchange the first place, the largest has a kink downwards. It rises to a maximum
            // along one multiplier, without a kink.
            let smooth = self.parabola(misses).filter(|_| side < 0.0);
            let bulge = smooth.map_or(kink, |parabola| kink.min(PARABOLA_MARGIN * parabola));
            let along = [left, right].map(|sizes| bend(sizes, step, side));
            let nearest = (side * a).min(side * b) - bulge - along[0].max(along[1]);
            bulge > 0.0 && nearest < 0.0
        })
    }
}

impl Gap<'_> {
    /// True if a tongue of instability may lie between two speeds: their gap is wider than [`TONGUE_GAP`], and at one
    /// of them or both [`shows_a_tongue`] holds.
    fn may_hide_a_tongue(&self) -> bool {
        self.right.rpm > self.left.rpm * (1.0 + TONGUE_GAP)
            && [self.left, self.right]
                .into_iter()
                .any(|line| shows_a_tongue(&line.largest))
    }
}

/// True if the largest |μ| over the depth shows a tongue of instability beside this speed: a maximum below 1 that rises
/// above the minima on both sides by more than its distance 1 − |μ| from the unit circle.
fn shows_a_tongue(largest: &[f64]) -> bool {
    let least = |sizes: &[f64]| sizes.iter().copied().fold(f64::INFINITY, f64::min);
    (1..largest.len().saturating_sub(1)).any(|step| {
        let peak = largest[step];
        let is_maximum = peak >= largest[step - 1] && peak >= largest[step + 1];
        let base = least(&largest[..step]).max(least(&largest[step + 1..]));
        peak < 1.0 && is_maximum && peak - base > 1.0 - peak
    })
}

/// Distance by which a kink within a gap lies off the straight line between the ends of the gap, from the prediction
/// errors of the extrapolations from both sides; from one error alone, an upper bound. `None` if neither error is
/// known.
fn kink_between(misses: [Option<f64>; 2]) -> Option<f64> {
    match misses {
        [Some(right), Some(left)] => {
            let sum = right.abs() + left.abs();
            Some(if sum > 0.0 {
                right.abs() * left.abs() / sum
            } else {
                0.0
            })
        }
        [Some(one), None] | [None, Some(one)] => Some(one.abs()),
        [None, None] => None,
    }
}

/// Distance by which the parabola of ln|μ| through a sample and both its neighbours in depth lies closer to 0 at the
/// middle of a step than the chord over the step: (second difference)/8. It is 0 if the parabola bends away from 0 or a
/// sample is missing.
fn bend(largest: &[f64], step: usize, side: f64) -> f64 {
    let at = |index: usize| largest.get(index).map(|size| side * logarithm(*size));
    let three = step
        .checked_sub(1)
        .and_then(|below| Some((at(below)?, at(step)?, at(step + 1)?)));
    three.map_or(0.0, |(below, here, above)| {
        ((below - 2.0 * here + above) / 8.0).max(0.0)
    })
}

/// ln|μ|, with |μ| bounded below at a thousandth: smaller multipliers are all far inside the unit circle.
fn logarithm(size: f64) -> f64 {
    size.max(1e-3).ln()
}
