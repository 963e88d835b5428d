//! Instants of a revolution at which teeth lose or find contact, meet the surface of another tooth, or a restoring
//! force changes its regime.

use quietcut_model::restoring_force::Regime;

use super::law::{Instant, Path, RegimeView};
use super::mesh::{Contact, EngagedTooth, Event, Mesh, SAME_TIME, Stretches};
use super::model::{CutModel, Ports};
use super::motion::Motion;

/// Samples per node in which changes of contact and regime are sought.
const SAMPLES_PER_NODE: usize = 2;
/// Largest number of changes between two samples.
const CHANGES_BETWEEN_SAMPLES: usize = 8;

/// A revolution whose motion is known.
pub(super) struct Revolution<'a> {
    pub(super) model: &'a CutModel,
    pub(super) ports: &'a Ports,
    pub(super) stretches: &'a Stretches,
    pub(super) mesh: &'a Mesh,
    pub(super) motion: &'a Motion,
}

/// Contact at the start of every stretch, and the events within them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Events {
    pub(super) starts: Vec<Contact>,
    pub(super) events: Vec<Event>,
}

impl Events {
    /// True if the same events happen in the same order.
    pub(super) fn are_like(&self, other: &Self) -> bool {
        self.starts == other.starts
            && self.events.len() == other.events.len()
            && self
                .events
                .iter()
                .zip(&other.events)
                .all(|(a, b)| a.contact == b.contact)
    }

    /// Takes the instants of `known` where these would no longer be in the order of time.
    pub(super) fn sort(&mut self, known: &Self) {
        let in_order = self.events.windows(2).all(|pair| pair[0].time_s < pair[1].time_s);
        if !in_order {
            for (event, known) in self.events.iter_mut().zip(&known.events) {
                event.time_s = known.time_s;
            }
        }
    }

    /// Largest distance between the instants of like events, s.
    pub(super) fn moved_s(&self, other: &Self) -> f64 {
        let pairs = self.events.iter().zip(&other.events);
        pairs
            .map(|(a, b)| (a.time_s - b.time_s).abs())
            .fold(0.0, f64::max)
    }
}

/// Change of one tooth or one restoring force.
enum Change {
    Tooth(EngagedTooth),
    Regime(usize, Regime),
}

impl Revolution<'_> {
    fn path(&self) -> impl Fn(f64) -> [f64; 3] + '_ {
        |time_s| self.motion.displacement(self.mesh, self.ports, time_s)
    }

    /// The events along the motion.
    pub(super) fn events(&self) -> Events {
        let path = self.path();
        let mut changes: Vec<(f64, Change)> = Vec::new();
        let mut starts = Vec::with_capacity(self.stretches.starts_s.len());
        let samples = self.samples();
        for (stretch, teeth) in self.stretches.teeth.iter().enumerate() {
            let mut first = Vec::with_capacity(teeth.len());
            for tooth in teeth {
                let (start, later) = self.tooth_changes(&samples[stretch], *tooth, &path);
                first.push(start);
                changes.extend(
                    later
                        .into_iter()
                        .map(|(time_s, tooth)| (time_s, Change::Tooth(tooth))),
                );
            }
            starts.push(Contact {
                teeth: first,
                regimes: Vec::new(),
            });
        }
        let (regimes, later) = self.regime_changes(&samples, &starts, &path);
        changes.extend(
            later
                .into_iter()
                .map(|(time_s, index, regime)| (time_s, Change::Regime(index, regime))),
        );
        changes.sort_by(|a, b| a.0.total_cmp(&b.0));
        self.joined(starts, regimes, changes)
    }

    /// Events with the whole contact after each.
    fn joined(&self, mut starts: Vec<Contact>, regimes: Vec<Regime>, changes: Vec<(f64, Change)>) -> Events {
        let near_s = SAME_TIME * self.mesh.revolution_s;
        let mut events: Vec<Event> = Vec::new();
        let mut now = regimes;
        let mut changes = changes.into_iter().peekable();
        for (stretch, start) in starts.iter_mut().enumerate() {
            let (start_s, end_s) = (self.stretches.starts_s[stretch], self.stretches.end_s(stretch));
            start.regimes.clone_from(&now);
            let mut contact = start.clone();
            while let Some((time_s, change)) = changes.next_if(|(time_s, _)| *time_s < end_s) {
                match change {
                    Change::Tooth(tooth) => {
                        contact
                            .teeth
                            .iter_mut()
                            .filter(|other| other.tooth == tooth.tooth)
                            .for_each(|other| *other = tooth);
                    }
                    Change::Regime(index, regime) => contact.regimes[index] = regime,
                }
                if time_s - start_s < near_s {
                    *start = contact.clone();
                } else if end_s - time_s < near_s {
                    // The next stretch begins with its own contact.
                } else if let Some(last) = events
                    .last_mut()
                    .filter(|last| last.time_s >= start_s && time_s - last.time_s < near_s)
                {
                    last.contact = contact.clone();
                } else {
                    events.push(Event {
                        time_s,
                        contact: contact.clone(),
                    });
                }
            }
            now = contact.regimes;
        }
        Events { starts, events }
    }

    /// Instants of each stretch at which the motion is looked at, from a little after its start to a little before its
    /// end.
    fn samples(&self) -> Vec<Vec<f64>> {
        let count = SAMPLES_PER_NODE * self.mesh.nodes();
        let mut samples = vec![Vec::new(); self.stretches.starts_s.len()];
        for subinterval in &self.mesh.subintervals {
            let at = |index: usize| {
                subinterval.start_s + subinterval.duration_s * (index as f64 + 0.5) / count as f64
            };
            samples[subinterval.stretch].extend((0..count).map(at));
        }
        let near_s = 10.0 * SAME_TIME * self.mesh.revolution_s;
        for (stretch, samples) in samples.iter_mut().enumerate() {
            samples.insert(0, self.stretches.starts_s[stretch] + near_s);
            samples.push(self.stretches.end_s(stretch) - near_s);
        }
        samples
    }

    /// State of a tooth in the workpiece: its contact with the lowest of the surfaces that the teeth before it left.
    fn engaged(&self, tooth: usize, time_s: f64, path: &Path<'_>) -> EngagedTooth {
        let x = path(time_s);
        let gaps = (1..=self.model.cutter.teeth.len())
            .map(|passings| (passings, self.model.gap_m(tooth, passings, time_s, x, path)));
        let nearest = gaps.min_by(|a, b| a.1.total_cmp(&b.1));
        EngagedTooth {
            tooth,
            passings: nearest
                .filter(|(_, gap_m)| *gap_m > 0.0)
                .map(|(passings, _)| passings),
        }
    }

    fn tooth_changes(
        &self,
        samples: &[f64],
        tooth: usize,
        path: &Path<'_>,
    ) -> (EngagedTooth, Vec<(f64, EngagedTooth)>) {
        let first = samples.first().map_or(
            EngagedTooth {
                tooth,
                passings: Some(1),
            },
            |time_s| self.engaged(tooth, *time_s, path),
        );
        let mut changes = Vec::new();
        let mut now = first;
        for pair in samples.windows(2) {
            let end = self.engaged(tooth, pair[1], path);
            let mut from_s = pair[0];
            for _ in 0..CHANGES_BETWEEN_SAMPLES {
                if now == end {
                    break;
                }
                let (mut low, mut high) = (from_s, pair[1]);
                let mut next = end;
                while high - low > 0.25 * SAME_TIME * self.mesh.revolution_s {
                    let middle = 0.5 * (low + high);
                    let there = self.engaged(tooth, middle, path);
                    if there == now {
                        low = middle;
                    } else {
                        (high, next) = (middle, there);
                    }
                }
                changes.push((high, next));
                (now, from_s) = (next, high);
            }
        }
        (first, changes)
    }

    /// Regimes at the start of the revolution, and their changes, in the second of two revolutions.
    fn regime_changes(
        &self,
        samples: &[Vec<f64>],
        starts: &[Contact],
        path: &Path<'_>,
    ) -> (Vec<Regime>, Vec<(f64, usize, Regime)>) {
        let forces = &self.model.restoring_forces;
        let all: Vec<f64> = samples.iter().flatten().copied().collect();
        let Some(first_s) = all.first().filter(|_| !forces.is_empty()) else {
            return (Vec::new(), Vec::new());
        };
        let margin =
            |index: usize, regime: Regime, time_s: f64| self.regime_view(index, regime, time_s, starts, path);
        let mut regimes: Vec<Regime> = (0..forces.len())
            .map(|index| {
                let view = margin(index, 0, *first_s);
                forces[index].next(None, &view.state, &view.own, 0.0)
            })
            .collect();
        let mut changes = Vec::new();
        let mut at_start = regimes.clone();
        for _ in 0..2 {
            changes.clear();
            at_start.clone_from(&regimes);
            let ends = all
                .iter()
                .skip(1)
                .copied()
                .chain([first_s + self.mesh.revolution_s]);
            for (from_s, to_s) in all.iter().zip(ends) {
                for (index, regime) in regimes.iter_mut().enumerate() {
                    let mut low_s = *from_s;
                    for _ in 0..CHANGES_BETWEEN_SAMPLES {
                        if margin(index, *regime, to_s).margin >= 0.0 {
                            break;
                        }
                        let (mut low, mut high) = (low_s, to_s);
                        while high - low > 0.25 * SAME_TIME * self.mesh.revolution_s {
                            let middle = 0.5 * (low + high);
                            if margin(index, *regime, middle).margin < 0.0 {
                                high = middle;
                            } else {
                                low = middle;
                            }
                        }
                        let view = margin(index, *regime, high);
                        let next =
                            forces[index].next(Some(*regime), &view.state, &view.own, view.would_hold_n);
                        if next == *regime {
                            break;
                        }
                        *regime = next;
                        changes.push((high, index, next));
                        low_s = high;
                    }
                }
            }
        }
        // Changes beyond the end of the revolution are those at its beginning.
        let (early, late): (Vec<_>, Vec<_>) = changes
            .into_iter()
            .partition(|(time_s, ..)| *time_s < self.mesh.revolution_s);
        let mut wrapped: Vec<_> = late
            .into_iter()
            .map(|(time_s, index, regime)| (time_s - self.mesh.revolution_s, index, regime))
            .collect();
        let mut at_zero = at_start;
        if !wrapped.is_empty() {
            // The regimes of the first sample hold after these changes; before them those of the last sample do.
            for (_, index, _) in &wrapped {
                let last = early.iter().rev().find(|(_, other, _)| other == index);
                if let Some((_, _, regime)) = last {
                    at_zero[*index] = *regime;
                }
            }
        }
        wrapped.extend(early);
        (at_zero, wrapped)
    }

    fn regime_view(
        &self,
        index: usize,
        regime: Regime,
        time_s: f64,
        starts: &[Contact],
        path: &Path<'_>,
    ) -> RegimeView {
        let time_s = time_s.rem_euclid(self.mesh.revolution_s);
        let subinterval = self.mesh.containing(time_s);
        let outputs = self.motion.within(self.mesh, subinterval, time_s);
        // For the force that holds the tool the teeth are those of the mesh, whose contact is that of the last step.
        let of = &self.mesh.subintervals[subinterval];
        let teeth = if of.contact.teeth.is_empty() {
            &starts[of.stretch].teeth
        } else {
            &of.contact.teeth
        };
        let mut regimes = of.contact.regimes.clone();
        regimes.resize(self.model.restoring_forces.len(), 0);
        regimes[index] = regime;
        let contact = Contact {
            teeth: teeth.clone(),
            regimes,
        };
        self.model.regime_view(
            self.ports,
            &Instant {
                time_s,
                contact: &contact,
                outputs: &outputs,
                path,
            },
            index,
        )
    }
}
