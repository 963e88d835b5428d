//! Stability at one spindle speed along a single uncertain variable: computed for a few machines, and interpolated
//! between them.
//!
//! A gap between two computed machines is halved. It is accepted if the machine in its middle has the limits that the
//! ends predict; otherwise both halves are gaps. Limits are interpolated as 1/w, which is linear in the cutting
//! coefficients where all of them change together.

use super::speed_line::{Limit, SpeedLine};
use crate::criteria::{ALONG_END, ALONG_GAP, ALONG_MISS, ALONG_STEP};
use crate::error::StabilityError;

/// Stability of a machine at one spindle speed; the reason if the machine is not valid.
pub(super) type MachineLine = Result<SpeedLine, String>;

/// Stability at one spindle speed along an uncertain variable.
pub(super) struct LinesAlong {
    /// Values of the variable, standard deviations, with the stability of the machine there; ascending.
    nodes: Vec<(f64, MachineLine)>,
}

impl LinesAlong {
    /// Computes the lines along a variable from −[`ALONG_END`] to [`ALONG_END`] standard deviations; `line` computes
    /// that of one machine.
    ///
    /// # Errors
    /// As `line`.
    pub(super) fn new(
        line: impl Fn(f64) -> Result<MachineLine, StabilityError>,
    ) -> Result<Self, StabilityError> {
        let gaps = (2.0 * ALONG_END / ALONG_STEP).round();
        let mut nodes = Vec::new();
        let mut left = (-ALONG_END, line(-ALONG_END)?);
        for gap in 1..=gaps as u32 {
            let value = -ALONG_END + 2.0 * ALONG_END * f64::from(gap) / gaps;
            let right = (value, line(value)?);
            let mut inner = Vec::new();
            fill(&line, &left, &right, &mut inner)?;
            nodes.push(std::mem::replace(&mut left, right));
            nodes.append(&mut inner);
        }
        nodes.push(left);
        Ok(Self { nodes })
    }

    /// Stability of the machine at a value of the variable, standard deviations; beyond the ends that of the last
    /// machine. Between two machines with different limits it is that of the nearer one.
    pub(super) fn at(&self, value: f64) -> MachineLine {
        let right = self
            .nodes
            .partition_point(|(node, _)| *node < value)
            .clamp(1, self.nodes.len() - 1);
        let ((low, left), (high, right)) = (&self.nodes[right - 1], &self.nodes[right]);
        let share = ((value - low) / (high - low)).clamp(0.0, 1.0);
        match (left, right) {
            (Ok(left), Ok(right)) if is_alike(left, right) => Ok(between(left, right, share)),
            _ if share < 0.5 => left.clone(),
            _ => right.clone(),
        }
    }
}

/// Appends the machines within a gap, in ascending order.
fn fill(
    line: &impl Fn(f64) -> Result<MachineLine, StabilityError>,
    left: &(f64, MachineLine),
    right: &(f64, MachineLine),
    inner: &mut Vec<(f64, MachineLine)>,
) -> Result<(), StabilityError> {
    if right.0 - left.0 <= ALONG_GAP || left.1.is_err() && right.1.is_err() {
        return Ok(());
    }
    let value = 0.5 * (left.0 + right.0);
    let middle = (value, line(value)?);
    let is_predicted = match (&left.1, &middle.1, &right.1) {
        (Ok(left), Ok(middle), Ok(right)) => {
            is_alike(left, right) && is_alike(left, middle) && is_near(&between(left, right, 0.5), middle)
        }
        _ => false,
    };
    if is_predicted {
        inner.push(middle);
        return Ok(());
    }
    fill(line, left, &middle, inner)?;
    inner.push(middle.clone());
    fill(line, &middle, right, inner)
}

/// True if two machines have as many stable and bistable intervals, and both have a first limit or neither has.
fn is_alike(a: &SpeedLine, b: &SpeedLine) -> bool {
    a.stable_mm.len() == b.stable_mm.len()
        && a.bistable_mm.len() == b.bistable_mm.len()
        && a.first_limit.is_some() == b.first_limit.is_some()
}

/// True if all ends of the intervals of two alike machines, and their first limits, agree to [`ALONG_MISS`].
fn is_near(predicted: &SpeedLine, computed: &SpeedLine) -> bool {
    let all = |line: &SpeedLine| -> Vec<f64> {
        let ends = line.stable_mm.iter().chain(&line.bistable_mm).flatten().copied();
        ends.chain(line.first_limit.map(|limit| limit.depth_mm)).collect()
    };
    let (predicted, computed) = (all(predicted), all(computed));
    let mut pairs = predicted.iter().zip(&computed);
    pairs.all(|(predicted, computed)| (predicted - computed).abs() <= ALONG_MISS * computed)
}

/// Line at a share of the way between two alike lines.
fn between(left: &SpeedLine, right: &SpeedLine, share: f64) -> SpeedLine {
    let depth = |a: f64, b: f64| {
        if a > 0.0 && b > 0.0 {
            ((1.0 - share) / a + share / b).recip()
        } else {
            (1.0 - share) * a + share * b
        }
    };
    let intervals = |a: &[[f64; 2]], b: &[[f64; 2]]| -> Vec<[f64; 2]> {
        let pairs = a.iter().zip(b);
        pairs
            .map(|(a, b)| [depth(a[0], b[0]), depth(a[1], b[1])])
            .collect()
    };
    let nearer = if share < 0.5 { left } else { right };
    let first_limit = left.first_limit.zip(right.first_limit).zip(nearer.first_limit);
    SpeedLine {
        rpm: left.rpm,
        stable_mm: intervals(&left.stable_mm, &right.stable_mm),
        undecided_mm: Vec::new(),
        bistable_mm: intervals(&left.bistable_mm, &right.bistable_mm),
        first_limit: first_limit.map(|((a, b), nearer)| Limit {
            depth_mm: depth(a.depth_mm, b.depth_mm),
            ..nearer
        }),
        switches: Vec::new(),
        spread: None,
        largest: Vec::new(),
        without_error: Vec::new(),
    }
}

#[cfg(test)]
mod tests;
