//! Error-controlled integration with event location: steps end where the right-hand side is not smooth.

use std::ops::Range;

use super::contact::{Change, Contact};
use super::criteria::{AT_REST, REGIME_CHANGES_MAX, REPEATED_CONTACT_CHANGES_MAX};
use super::dense_step::{DenseStep, Workspace};
use super::error::SimulateError;
use super::model::{Model, StepContext};
use super::settings::Settings;
use quietcut_model::restoring_force::{self, MotionState, Regime, Regimes};
use quietcut_numerics::crossing::first_below_zero;
use quietcut_numerics::dormand_prince::{DormandPrince, Quartic, at};

/// Numbers of integration steps and events of one simulation run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Accepted steps.
    pub steps: u64,
    /// Number of integration steps rejected because their error was not within the tolerance.
    pub rejected: u64,
    /// Number of times that a tooth lost or regained contact within the engagement arc.
    pub contact_changes: u64,
    /// Number of times that a regime of a restoring force, such as stick or slip, ended.
    pub regime_changes: u64,
}

/// Time integration of a model in progress: time, states, regimes and the last step.
pub(super) struct Integrator<'a> {
    model: &'a Model,
    settings: Settings,
    contact: Option<Contact<'a>>,
    step: DormandPrince,
    t: f64,
    y: Vec<f64>,
    quartics: Vec<Quartic>,
    displacement: [Quartic; 3],
    /// Planned length of the next integration step, s.
    next_h: f64,
    statistics: Statistics,
    workspace: Workspace,
    /// The regime of each restoring force, such as stick or slip, in the order of [`Model::restoring_forces`].
    regimes: Vec<Regime>,
    /// [`Model::moving`].
    moving: Vec<Range<usize>>,
    /// Start and end of the integration step that is evaluated, s, moved inwards by a rounding margin.
    within: [f64; 2],
}

/// An event that ends an integration step early.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Event {
    /// A tooth loses or regains contact.
    Contact(Change),
    /// Restoring force number `index` leaves its regime at the fraction `u` of the integration step.
    RegimeEnd { index: usize, u: f64 },
}

impl Event {
    /// Time of the event as a fraction of the integration step, 0 to 1.
    fn u(self) -> f64 {
        match self {
            Self::Contact(change) => change.u,
            Self::RegimeEnd { u, .. } => u,
        }
    }
}

impl<'a> Integrator<'a> {
    pub(super) fn new(model: &'a Model, settings: Settings, y: Vec<f64>) -> Self {
        let contact = model
            .cutting
            .as_ref()
            .map(|cutting| Contact::new(cutting, model.dynamics.velocity_jumps()));
        Self {
            model,
            settings,
            contact,
            step: DormandPrince::new(y.len()),
            t: 0.0,
            quartics: vec![[0.0; 5]; y.len()],
            y,
            displacement: [[0.0; 5]; 3],
            next_h: 0.0,
            statistics: Statistics::default(),
            regimes: vec![0; model.restoring_forces.len()],
            moving: model.moving(),
            workspace: Workspace::new(model),
            within: [0.0; 2],
        }
    }

    /// Integrates to the time `end_s`, s; `observe` receives every accepted step in the order of time.
    pub(super) fn run(
        mut self,
        end_s: f64,
        mut observe: impl FnMut(&DenseStep<'_>),
    ) -> Result<Statistics, SimulateError> {
        // The first integration step is much shorter than allowed; error control enlarges it within a few steps.
        self.next_h = 1e-3 * self.longest_step(end_s);
        for index in 0..self.regimes.len() {
            self.regimes[index] = self.next_regime(index, None);
        }
        self.start();
        let mut stuck = 0;
        while self.t < end_s {
            let steps = self.statistics.steps + self.statistics.rejected;
            if steps > self.settings.steps_max {
                let time_s = self.t;
                return Err(SimulateError::TooManySteps { time_s, steps });
            }
            let stop_s = self.next_stop(end_s);
            let (h, event) = self.step_towards(stop_s)?;
            if h > 0.0 {
                self.accept(h, &mut observe)?;
                stuck = 0;
            }
            let at_stop = event.is_none() && stop_s - self.t <= self.rounding_s();
            if let Some(event) = event {
                self.change(event, &mut stuck)?;
            }
            if at_stop {
                self.t = stop_s;
                self.switch();
            }
            if at_stop || event.is_some() {
                self.start();
            }
        }
        Ok(self.statistics)
    }

    fn change(&mut self, event: Event, stuck: &mut u32) -> Result<(), SimulateError> {
        match event {
            Event::Contact(change) => {
                self.statistics.contact_changes += 1;
                if let Some(contact) = &mut self.contact
                    && !contact.change(change.tooth, self.t)
                {
                    *stuck += 1;
                }
                if *stuck > REPEATED_CONTACT_CHANGES_MAX {
                    return Err(SimulateError::ContactUndecided {
                        time_s: self.t,
                        tooth: change.tooth + 1,
                    });
                }
            }
            Event::RegimeEnd { index, .. } => {
                self.statistics.regime_changes += 1;
                self.regimes[index] = self.next_regime(index, Some(self.regimes[index]));
                // Just after a change a restoring force counts as within its new regime (see `first_below_zero`), so it
                // should not change again at once. More changes than allowed without a step between them mean that no
                // regime is consistent with the motion.
                *stuck += 1;
                if *stuck > REGIME_CHANGES_MAX {
                    return Err(SimulateError::RegimeUndecided { time_s: self.t });
                }
            }
        }
        Ok(())
    }

    /// The regime of a restoring force from the current time on, which the force enters. If it is locked, the velocity
    /// along its axis is set to zero.
    fn next_regime(&mut self, index: usize, before: Option<Regime>) -> Regime {
        let restoring_force = &self.model.restoring_forces[index];
        let (at, state_range) = (self.at(self.t, &self.y), self.state_range(index));
        let holding_n = self.holding_n(index, self.t, &self.y.clone());
        let regime = restoring_force.next(before, &at, &self.y[state_range.clone()], holding_n);
        restoring_force.enter(regime, &at, &mut self.y[state_range]);
        if let Some(axis) = restoring_force.holds().filter(|_| restoring_force.locked(regime)) {
            let order = self.model.dynamics.order();
            self.model.dynamics.halt(axis, &mut self.y[..order]);
        }
        regime
    }

    fn at(&self, t: f64, y: &[f64]) -> MotionState {
        let dynamics = &self.model.dynamics;
        let structure = &y[..dynamics.order()];
        MotionState {
            t,
            x: dynamics.displacement(structure),
            v: dynamics.velocity_under(structure, [0.0; 3]),
        }
    }

    /// Index range, in the state vector y, of the internal states of restoring force number `index`.
    fn state_range(&self, index: usize) -> Range<usize> {
        let restoring_forces = &self.model.restoring_forces;
        let from = self.model.dynamics.order() + restoring_force::states(&restoring_forces[..index]);
        from..from + restoring_forces[index].states()
    }

    /// The force f_r, N, that keeps the axis of a restoring force at rest at the time `t`; 0 for a restoring force
    /// without a locked regime.
    fn holding_n(&mut self, index: usize, t: f64, y: &[f64]) -> f64 {
        let Some(axis) = self.model.restoring_forces[index].holds() else {
            return 0.0;
        };
        let mut rate = std::mem::take(&mut self.workspace.rate);
        let holding = self.held_n(index, axis, (t, y), &mut rate);
        self.workspace.rate = rate;
        holding
    }

    fn held_n(&self, index: usize, axis: usize, (t, y): (f64, &[f64]), rate: &mut [f64]) -> f64 {
        let model = self.model;
        let x = model.dynamics.displacement(&y[..model.dynamics.order()]);
        let context = self.context();
        let force = model.force_n(context, t, x, y);
        let held = restoring_force::rate(
            &model.dynamics,
            &model.restoring_forces,
            context.regimes,
            (t, x),
            force,
            y,
            rate,
        );
        if model.restoring_forces[index].locked(self.regimes[index]) {
            return held[axis];
        }
        // The state derivative `rate` was computed with the friction force of slip. The holding force is that force
        // plus the one that makes the axis's acceleration zero.
        let at = self.at(t, y);
        let sliding =
            model.restoring_forces[index].restoring_n(self.regimes[index], &at, &y[self.state_range(index)]);
        let locked = std::array::from_fn(|other| other == axis);
        sliding[axis]
            + restoring_force::holding_n(&model.dynamics, locked, &rate[..model.dynamics.order()])[axis]
    }

    fn context(&self) -> StepContext<'_> {
        StepContext {
            contact: self.contact.as_ref(),
            within: self.within,
            regimes: Regimes(&self.regimes),
        }
    }

    /// Restarts the integration after a discontinuity: evaluates the state derivative ẏ at the start of the next step.
    fn start(&mut self) {
        self.set_step(self.next_h);
        let model = self.model;
        let context = StepContext {
            contact: self.contact.as_ref(),
            within: self.within,
            regimes: Regimes(&self.regimes),
        };
        self.step.start(self.t, &self.y, |t, y, rate| {
            model.rate(context, (t, model.dynamics.displacement(y)), y, rate);
        });
    }

    /// Sets the integration step of length `h`, s, from the current time as the one to evaluate.
    fn set_step(&mut self, h: f64) {
        let inset = 1e-9 * h;
        self.within = [self.t + inset, self.t + h - inset];
        if let Some(contact) = &mut self.contact {
            contact.set_step(self.t, self.t + h);
        }
    }

    /// Attempts steps from the current time until the error is within tolerance; fails if the step would be shorter
    /// than the rounding of the time. Returns the length, s, of the step, which is not yet accepted, and the event at
    /// its end, if there is one. Length 0 means that the event is at the current time.
    fn step_towards(&mut self, stop_s: f64) -> Result<(f64, Option<Event>), SimulateError> {
        let mut h = self.next_h;
        let is_held = self.is_held();
        if is_held {
            h = h.min(self.longest_step_at_rest());
        }
        loop {
            h = self.fitted(h, stop_s);
            let error = self.attempt(h);
            if error <= 1.0 {
                let grown = h * (0.9 * error.max(1e-8).powf(-0.2)).clamp(0.2, 5.0);
                // If the step was shortened, but not by a rejection, the next step is planned at least as long as this
                // one was, before the limits below.
                self.next_h = if h < self.next_h {
                    grown.max(self.next_h)
                } else {
                    grown
                };
                self.next_h = self.next_h.min(self.longest_step(f64::INFINITY));
                if is_held || error < AT_REST {
                    self.next_h = self.next_h.min(self.longest_step_at_rest());
                }
                break;
            }
            self.statistics.rejected += 1;
            // An error that is not finite also shortens the step.
            let shrunk = if error.is_finite() {
                (0.9 * error.powf(-0.2)).max(0.1)
            } else {
                0.1
            };
            h *= shrunk;
            self.next_h = h;
            if h < self.rounding_s() {
                return Err(self.diverged());
            }
        }
        let Some(event) = self.first_event(h) else {
            return Ok((h, None));
        };
        let shorter = event.u() * h;
        if shorter <= self.rounding_s() {
            return Ok((0.0, Some(event)));
        }
        // The error of the shortened step is not tested: that of the longer step was acceptable.
        self.attempt(shorter);
        Ok((shorter, Some(event)))
    }

    /// The first event detected within the last attempted integration step of length `h`, s; `None` if there is none.
    fn first_event(&mut self, h: f64) -> Option<Event> {
        let contact = self
            .contact
            .as_ref()
            .and_then(|contact| contact.first_change(self.t, h, &self.displacement))
            .map(Event::Contact);
        let mut workspace = std::mem::take(&mut self.workspace);
        let restoring_forces: Option<Event> = (0..self.regimes.len())
            .filter_map(|index| self.end_of_regime(index, h, &mut workspace))
            .min_by(|a, b| a.u().total_cmp(&b.u()));
        self.workspace = workspace;
        match (contact, restoring_forces) {
            (Some(contact), Some(restoring_force)) if contact.u() > restoring_force.u() => {
                Some(restoring_force)
            }
            (Some(contact), _) => Some(contact),
            (None, restoring_force) => restoring_force,
        }
    }

    fn end_of_regime(&self, index: usize, h: f64, workspace: &mut Workspace) -> Option<Event> {
        let (restoring_force, regime) = (&self.model.restoring_forces[index], self.regimes[index]);
        let state_range = self.state_range(index);
        workspace.state.copy_from_slice(&self.y);
        let workspace = std::cell::RefCell::new(workspace);
        let margin = |u: f64| {
            let mut workspace = workspace.borrow_mut();
            let Workspace { state, rate, .. } = &mut **workspace;
            for range in &self.moving {
                let quartics = &self.quartics[range.clone()];
                for (state, quartic) in state[range.clone()].iter_mut().zip(quartics) {
                    *state = at(quartic, u);
                }
            }
            let t = self.t + u * h;
            let holding_n = match restoring_force.holds().filter(|_| restoring_force.locked(regime)) {
                Some(axis) => self.held_n(index, axis, (t, state), rate),
                None => 0.0,
            };
            restoring_force.margin(regime, &self.at(t, state), &state[state_range.clone()], holding_n)
        };
        first_below_zero(margin).map(|u| Event::RegimeEnd { index, u })
    }

    /// Attempts one integration step of length `h`, s, and its dense output; returns the step's local error divided by
    /// the tolerance.
    fn attempt(&mut self, h: f64) -> f64 {
        self.set_step(h);
        let model = self.model;
        let context = StepContext {
            contact: self.contact.as_ref(),
            within: self.within,
            regimes: Regimes(&self.regimes),
        };
        self.step.attempt(self.t, h, &self.y, |t, y, rate| {
            model.rate(context, (t, model.dynamics.displacement(y)), y, rate);
        });
        self.step.interpolant(h, &self.y, &mut self.quartics);
        self.displacement = model.dynamics.displacement_quartics(&self.quartics);
        let sizes = model.dynamics.sizes();
        let allowed_m = self.settings.absolute_m + self.settings.relative * self.amplitude_m();
        self.step.error(h, |element| {
            sizes.get(element).copied().unwrap_or(1.0) * allowed_m
        })
    }

    /// Largest state of the structure at the two ends of the last attempted integration step, converted into a
    /// displacement of the tool, m.
    fn amplitude_m(&self) -> f64 {
        let ends = self.y.iter().zip(self.step.end());
        ends.zip(self.model.dynamics.sizes())
            .map(|((y, end), size)| y.abs().max(end.abs()) / size)
            .fold(0.0, f64::max)
    }

    fn accept(&mut self, h: f64, observe: &mut impl FnMut(&DenseStep<'_>)) -> Result<(), SimulateError> {
        if self.amplitude_m() > self.settings.largest_m {
            return Err(self.diverged());
        }
        observe(&DenseStep {
            model: self.model,
            context: self.context(),
            quartics: &self.quartics,
            displacement: &self.displacement,
            from_s: self.t,
            to_s: self.t + h,
        });
        if let Some(contact) = &mut self.contact {
            contact.record(self.t, h, &self.displacement);
        }
        self.t += h;
        self.y.copy_from_slice(self.step.end());
        self.step.follow();
        self.statistics.steps += 1;
        Ok(())
    }

    fn switch(&mut self) {
        let Some(contact) = &mut self.contact else { return };
        let x = self.model.dynamics.displacement(&self.y);
        self.workspace.state.copy_from_slice(&self.y);
        let context = StepContext {
            contact: Some(contact),
            within: self.within,
            regimes: Regimes(&self.regimes),
        };
        self.model.rate(
            context,
            (self.t, x),
            &self.workspace.state,
            &mut self.workspace.rate,
        );
        let v = self.model.dynamics.velocity(&self.workspace.rate);
        contact.switch(self.t, x, v);
    }

    /// The next time known in advance, s, at which the right-hand side is not smooth, at most `end_s`.
    fn next_stop(&self, end_s: f64) -> f64 {
        let contact = self
            .contact
            .as_ref()
            .map_or(f64::INFINITY, |contact| contact.next_switch_s(self.t));
        let drive = self.model.drive.as_ref().map_or(f64::INFINITY, |drive| {
            drive.next_knot_s(self.t + self.rounding_s())
        });
        contact.min(drive).min(end_s)
    }

    /// The longest integration step, s: half the shortest tooth-passing period, so that the surface in front of a tooth
    /// is known. Without a cut it is `end_s`.
    fn longest_step(&self, end_s: f64) -> f64 {
        self.contact
            .as_ref()
            .map_or(end_s, |contact| 0.5 * contact.shortest_delay_s())
    }

    /// The longest step while the tool is at rest or friction sticks, s. The motion has then no error that would
    /// shorten the step, so the excitation force limits it; infinite without one.
    fn longest_step_at_rest(&self) -> f64 {
        let drive = self.model.drive.as_ref();
        drive.map_or(f64::INFINITY, |drive| drive.longest_step_s())
    }

    fn is_held(&self) -> bool {
        let mut regimes = self.model.restoring_forces.iter().zip(&self.regimes);
        regimes.any(|(restoring_force, regime)| restoring_force.locked(*regime))
    }

    /// Length of the step, s: `h`, or all or half of the time left to `stop_s`, so that no very short step is left.
    fn fitted(&self, h: f64, stop_s: f64) -> f64 {
        let left = stop_s - self.t;
        if h >= 0.99 * left {
            left
        } else if 2.0 * h > left {
            0.5 * left
        } else {
            h
        }
    }

    /// Rounding error of the simulated time, s: two times closer than this count as equal.
    fn rounding_s(&self) -> f64 {
        8.0 * f64::EPSILON * self.t
    }

    fn diverged(&self) -> SimulateError {
        SimulateError::Diverged {
            time_s: self.t,
            displacement_mm: 1e3 * self.amplitude_m(),
        }
    }
}
