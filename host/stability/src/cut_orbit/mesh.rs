//! Mesh of one revolution: subintervals that end wherever the force is not smooth.

use std::f64::consts::TAU;

use quietcut_model::{Cutter, restoring_force::Regime};
use quietcut_numerics::quadrature::Gauss;

/// Two instants closer than this share of a revolution are one. Rounding of angles stays far below, and two events of a
/// cut are further apart.
pub(super) const SAME_TIME: f64 = 1e-11;

/// A split of the mesh is left out if an event is nearer than this share of a revolution.
const NEAR_EVENT: f64 = 1e-5;

/// A tooth between entry and exit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct EngagedTooth {
    /// Index of the tooth.
    pub(super) tooth: usize,
    /// Number of tooth passings since the surface in front was cut, if the tooth cuts; `None` if it has no contact.
    pub(super) passings: Option<usize>,
}

/// What is constant within a subinterval: the teeth in the workpiece with the surface each cuts, and the regimes of the
/// restoring forces.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Contact {
    pub(super) teeth: Vec<EngagedTooth>,
    pub(super) regimes: Vec<Regime>,
}

/// Part of a revolution within which the force on the tool is smooth.
#[derive(Clone, Debug)]
pub(super) struct Subinterval {
    /// Start, s from the beginning of the revolution.
    pub(super) start_s: f64,
    pub(super) duration_s: f64,
    pub(super) contact: Contact,
    /// Index of the event at the start; `None` if none, or if the instant is fixed by the geometry.
    pub(super) event: Option<usize>,
    /// Index of the stretch in which the subinterval lies.
    pub(super) stretch: usize,
}

/// An instant at which contact or regimes change on the orbit.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Event {
    /// s from the beginning of the revolution.
    pub(super) time_s: f64,
    /// From this instant on.
    pub(super) contact: Contact,
}

/// The stretches between instants that do not depend on the motion: entries and exits of teeth, and where a tooth meets
/// the surface that the tooth before it cut at such an instant.
#[derive(Clone, Debug)]
pub(super) struct Stretches {
    /// Starts, s; the first is 0.
    pub(super) starts_s: Vec<f64>,
    /// Teeth between entry and exit in each stretch.
    pub(super) teeth: Vec<Vec<usize>>,
    pub(super) revolution_s: f64,
}

impl Stretches {
    /// Stretches of a revolution at the spindle speed `rad_per_s`, rad/s, with tooth j at the immersion angle Ωt + ψ_j.
    pub(super) fn new(cutter: &Cutter, rad_per_s: f64) -> Self {
        let revolution_s = TAU / rad_per_s;
        let arc_rad = cutter.exit_rad - cutter.start_rad;
        let entry = |angle_rad: f64| (cutter.start_rad - angle_rad).rem_euclid(TAU);
        let mut angles: Vec<f64> = vec![0.0];
        for tooth in &cutter.teeth {
            let entry_rad = entry(tooth.angle_rad);
            angles.extend([entry_rad, (entry_rad + arc_rad).rem_euclid(TAU)]);
        }
        let jumps = angles.clone();
        for tooth in &cutter.teeth {
            // Where a tooth meets what the tool did at a jump of the force, its chip has a kink in its slope.
            let met = jumps
                .iter()
                .map(|angle| (angle + tooth.pitch_rad).rem_euclid(TAU));
            let entry_rad = entry(tooth.angle_rad);
            angles.extend(met.filter(|angle| (angle - entry_rad).rem_euclid(TAU) < arc_rad));
        }
        angles.sort_by(f64::total_cmp);
        angles.dedup_by(|a, b| (*a - *b).abs() < TAU * SAME_TIME);
        if angles.last().is_some_and(|last| TAU - last < TAU * SAME_TIME) {
            angles.pop();
        }
        let ends = angles.iter().skip(1).copied().chain([TAU]);
        let teeth = angles
            .iter()
            .zip(ends)
            .map(|(from, to)| {
                let middle = 0.5 * (from + to);
                let is_engaged = |index: &usize| {
                    let angle_rad = cutter.teeth[*index].angle_rad;
                    (middle - entry(angle_rad)).rem_euclid(TAU) < arc_rad
                };
                (0..cutter.teeth.len()).filter(is_engaged).collect()
            })
            .collect();
        Self {
            starts_s: angles.iter().map(|angle| angle / rad_per_s).collect(),
            teeth,
            revolution_s,
        }
    }

    pub(super) fn end_s(&self, stretch: usize) -> f64 {
        self.starts_s
            .get(stretch + 1)
            .copied()
            .unwrap_or(self.revolution_s)
    }
}

/// Subintervals of a revolution, in the order of time, with Gauss nodes in each.
#[derive(Clone, Debug)]
pub(super) struct Mesh {
    pub(super) subintervals: Vec<Subinterval>,
    pub(super) gauss: &'static Gauss,
    pub(super) revolution_s: f64,
    /// Number of events at whose instants subintervals start.
    pub(super) events: usize,
}

impl Mesh {
    /// Mesh of the stretches, cut at `splits`, s, and at the events, both in the order of time. `starts` is the contact
    /// at the start of each stretch.
    pub(super) fn new(
        stretches: &Stretches,
        splits: &[f64],
        starts: &[Contact],
        events: &[Event],
        gauss: &'static Gauss,
    ) -> Self {
        let mut subintervals: Vec<Subinterval> = Vec::new();
        // A split beside an event would leave a subinterval of no use.
        let apart_s = NEAR_EVENT * stretches.revolution_s;
        let is_apart = |split: &f64| !events.iter().any(|event| (event.time_s - split).abs() < apart_s);
        let mut splits = splits.iter().copied().filter(is_apart).peekable();
        let mut numbered = events.iter().enumerate().peekable();
        for (stretch, &start_s) in stretches.starts_s.iter().enumerate() {
            let end_s = stretches.end_s(stretch);
            let (mut from_s, mut contact, mut event) = (start_s, &starts[stretch], None);
            loop {
                let next_split = splits.peek().copied().filter(|split| *split < end_s);
                let next_event = numbered
                    .peek()
                    .map(|(_, event)| event.time_s)
                    .filter(|time_s| *time_s < end_s);
                let to_s = next_split.unwrap_or(end_s).min(next_event.unwrap_or(end_s));
                subintervals.push(Subinterval {
                    start_s: from_s,
                    duration_s: to_s - from_s,
                    contact: contact.clone(),
                    event,
                    stretch,
                });
                (from_s, event) = (to_s, None);
                if next_event == Some(to_s) {
                    if let Some((index, found)) = numbered.next() {
                        (contact, event) = (&found.contact, Some(index));
                    }
                } else if next_split == Some(to_s) {
                    splits.next();
                } else {
                    break;
                }
            }
        }
        Self {
            subintervals,
            gauss,
            revolution_s: stretches.revolution_s,
            events: events.len(),
        }
    }

    /// Number of nodes in a subinterval.
    pub(super) fn nodes(&self) -> usize {
        self.gauss.nodes.len()
    }

    /// Number of points: the start and the nodes of every subinterval.
    pub(super) fn points(&self) -> usize {
        self.subintervals.len() * (self.nodes() + 1)
    }

    /// Index of the point at the start of a subinterval, or at its node number `place` − 1.
    pub(super) fn point(&self, subinterval: usize, place: usize) -> usize {
        subinterval * (self.nodes() + 1) + place
    }

    /// Time of a node, s.
    pub(super) fn time_s(&self, subinterval: usize, node: usize) -> f64 {
        let of = &self.subintervals[subinterval];
        of.start_s + of.duration_s * self.gauss.nodes[node]
    }

    /// Index of the subinterval that contains an instant of the revolution; of two that meet there, the later one.
    pub(super) fn containing(&self, time_s: f64) -> usize {
        self.subintervals
            .partition_point(|subinterval| subinterval.start_s <= time_s)
            .saturating_sub(1)
    }

    /// Points of a subinterval, with weights that interpolate a smooth function at the instant `time_s`: start, nodes
    /// and end.
    pub(super) fn interpolation(&self, subinterval: usize, time_s: f64) -> Interpolation {
        let of = &self.subintervals[subinterval];
        let place = (time_s - of.start_s) / of.duration_s;
        let next = (subinterval + 1) % self.subintervals.len();
        // After a Newton step the velocity jumps at an event that has moved: its value there is that after the event.
        let with_end = self.subintervals[next].event.is_none();
        let weights = barycentric(self.gauss, with_end, place);
        Interpolation {
            first: self.point(subinterval, 0),
            end: self.point(next, 0),
            last: self.nodes() + 1,
            weights,
        }
    }

    /// [`Self::interpolation`] at any time, taken modulo the revolution.
    pub(super) fn interpolation_at(&self, time_s: f64) -> Interpolation {
        let time_s = time_s.rem_euclid(self.revolution_s);
        self.interpolation(self.containing(time_s), time_s)
    }
}

/// Weights of the points of a subinterval: start, nodes, end.
#[derive(Clone, Debug)]
pub(super) struct Interpolation {
    first: usize,
    end: usize,
    /// Weights of start and nodes, and of the end unless an event is there.
    weights: Vec<f64>,
    last: usize,
}

impl Interpolation {
    /// Points with their weights.
    pub(super) fn points(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let last = self.last;
        self.weights
            .iter()
            .enumerate()
            .map(move |(place, weight)| {
                (
                    if place == last {
                        self.end
                    } else {
                        self.first + place
                    },
                    *weight,
                )
            })
            .filter(|(_, weight)| *weight != 0.0)
    }
}

/// Weights at `place` of the polynomial through 0, the Gauss nodes and, `with_end`, 1 (Berrut & Trefethen, SIAM Review
/// 46, 2004).
fn barycentric(gauss: &Gauss, with_end: bool, place: f64) -> Vec<f64> {
    let end = with_end.then_some(&1.0);
    let places: Vec<f64> = [0.0].iter().chain(&gauss.nodes).chain(end).copied().collect();
    if let Some(exact) = places.iter().position(|other| *other == place) {
        return (0..places.len())
            .map(|index| f64::from(u8::from(index == exact)))
            .collect();
    }
    let of = |own: usize| -> f64 {
        let others = places.iter().enumerate().filter(|(index, _)| *index != own);
        let product: f64 = others.map(|(_, other)| places[own] - other).product();
        1.0 / (product * (place - places[own]))
    };
    let mut weights: Vec<f64> = (0..places.len()).map(of).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|weight| *weight /= sum);
    weights
}
