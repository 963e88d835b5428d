//! Steps of controlled error that end exactly where the right-hand side is not smooth.

use super::contact::{Change, Contact};
use super::dormand_prince::{DormandPrince, Quartic, at};
use super::{Model, Settings, SimulateError};

/// What a run took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Steps taken.
    pub steps: u64,
    /// Steps tried again because their error was too large.
    pub rejected: u64,
    /// Times at which a tooth lost or found contact.
    pub contact_changes: u64,
}

/// A stretch of the motion, to be read while it is the newest one.
pub struct Segment<'a> {
    model: &'a Model,
    contact: Option<&'a Contact<'a>>,
    quartics: &'a [Quartic],
    displacement: &'a [Quartic; 3],
    within: [f64; 2],
    from_s: f64,
    to_s: f64,
}

/// The tool at one instant, in the machine's x, y, z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// m.
    pub displacement_m: [f64; 3],
    /// m/s.
    pub velocity_m_per_s: [f64; 3],
    /// m/s²; `None` where the structure has none at an instant, see [`super::Dynamics::velocity_jumps`].
    pub acceleration_m_per_s2: Option<[f64; 3]>,
    /// Force on the tool, N.
    pub force_n: [f64; 3],
}

/// Room to compute a [`Motion`] in.
#[derive(Clone, Debug)]
pub struct Room {
    state: Vec<f64>,
    rate: Vec<f64>,
}

impl Room {
    /// Room for the states of `model`.
    pub fn new(model: &Model) -> Self {
        let room = vec![0.0; model.dynamics.order()];
        Self {
            state: room.clone(),
            rate: room,
        }
    }
}

impl Segment<'_> {
    /// Where it begins, s.
    pub fn from_s(&self) -> f64 {
        self.from_s
    }

    /// Where it ends, s.
    pub fn to_s(&self) -> f64 {
        self.to_s
    }

    /// The motion at `t` within the stretch.
    pub fn motion(&self, t: f64, room: &mut Room) -> Motion {
        let u = (t - self.from_s) / (self.to_s - self.from_s);
        for (state, quartic) in room.state.iter_mut().zip(self.quartics) {
            *state = at(quartic, u);
        }
        let displacement_m = std::array::from_fn(|axis| at(&self.displacement[axis], u));
        let force_n = self.model.force_n(self.contact, self.within, t, displacement_m);
        let dynamics = &self.model.dynamics;
        dynamics.rate(&room.state, force_n, &mut room.rate);
        Motion {
            displacement_m,
            velocity_m_per_s: dynamics.velocity(&room.rate),
            acceleration_m_per_s2: dynamics.acceleration(&room.rate),
            force_n,
        }
    }
}

/// A run in progress.
pub(super) struct Integrator<'a> {
    model: &'a Model,
    settings: Settings,
    contact: Option<Contact<'a>>,
    step: DormandPrince,
    t: f64,
    y: Vec<f64>,
    quartics: Vec<Quartic>,
    displacement: [Quartic; 3],
    /// Length of the next step if nothing comes between.
    next_h: f64,
    statistics: Statistics,
    room: Room,
    /// The stretch looked at, a little shortened at both ends.
    within: [f64; 2],
}

/// Changes of contact in a row without a step between them before a run is given up.
const STUCK: u32 = 3;

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
            room: Room::new(model),
            within: [0.0; 2],
        }
    }

    /// Runs to `end_s`; `observe` sees every stretch in its order.
    pub(super) fn run(
        mut self,
        end_s: f64,
        mut observe: impl FnMut(&Segment<'_>),
    ) -> Result<Statistics, SimulateError> {
        // Small enough for anything; the first steps find out.
        self.next_h = 1e-3 * self.longest_step(end_s);
        self.start();
        let mut stuck = 0;
        while self.t < end_s {
            let stop_s = self.next_stop(end_s);
            let (h, change) = self.step_towards(stop_s)?;
            if h > 0.0 {
                self.accept(h, &mut observe)?;
                stuck = 0;
            }
            let at_stop = change.is_none() && stop_s - self.t <= self.rounding_s();
            if let (Some(change), Some(contact)) = (change, &mut self.contact) {
                self.statistics.contact_changes += 1;
                if !contact.change(change.tooth, self.t) {
                    stuck += 1;
                }
                if stuck > STUCK {
                    return Err(SimulateError::ContactUndecided {
                        time_s: self.t,
                        tooth: change.tooth + 1,
                    });
                }
            }
            if at_stop {
                self.t = stop_s;
                self.switch();
            }
            if at_stop || change.is_some() {
                self.start();
            }
        }
        Ok(self.statistics)
    }

    /// ẏ at the start of a smooth stretch.
    fn start(&mut self) {
        self.look_ahead(self.next_h);
        let (model, contact, within) = (self.model, self.contact.as_ref(), self.within);
        self.step.start(self.t, &self.y, |t, y, rate| {
            model.rate(contact, within, t, y, rate)
        });
    }

    /// Looks at the smooth stretch that begins here.
    fn look_ahead(&mut self, h: f64) {
        let inset = 1e-9 * h;
        self.within = [self.t + inset, self.t + h - inset];
        if let Some(contact) = &mut self.contact {
            contact.look_at(self.t, self.t + h);
        }
    }

    /// Tries steps until one is good; its length, and the change of contact at its end. It is not taken yet.
    ///
    /// Length 0: contact changes here and now.
    fn step_towards(&mut self, stop_s: f64) -> Result<(f64, Option<Change>), SimulateError> {
        let mut h = self.next_h;
        loop {
            h = self.fitted(h, stop_s);
            let error = self.attempt(h);
            if error <= 1.0 {
                let grown = h * (0.9 * error.max(1e-8).powf(-0.2)).clamp(0.2, 5.0);
                // A step cut short by a switch says little about the next: it does not shrink it.
                self.next_h = if h < self.next_h {
                    grown.max(self.next_h)
                } else {
                    grown
                };
                self.next_h = self.next_h.min(self.longest_step(f64::INFINITY));
                break;
            }
            self.statistics.rejected += 1;
            // NaN shrinks as well.
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
        let Some(change) = self.first_change(h) else {
            return Ok((h, None));
        };
        let shorter = change.u * h;
        if shorter <= self.rounding_s() {
            return Ok((0.0, Some(change)));
        }
        // A shorter step of an accepted one is at least as exact.
        self.attempt(shorter);
        Ok((shorter, Some(change)))
    }

    fn first_change(&self, h: f64) -> Option<Change> {
        self.contact
            .as_ref()
            .and_then(|contact| contact.first_change(self.t, h, &self.displacement))
    }

    /// Tries one step and makes its interpolant; the error in units of what is allowed.
    fn attempt(&mut self, h: f64) -> f64 {
        self.look_ahead(h);
        let (model, contact, within) = (self.model, self.contact.as_ref(), self.within);
        self.step.attempt(self.t, h, &self.y, |t, y, rate| {
            model.rate(contact, within, t, y, rate);
        });
        self.step.interpolant(h, &self.y, &mut self.quartics);
        self.displacement = model.dynamics.displacement_quartics(&self.quartics);
        let sizes = model.dynamics.sizes();
        let allowed_m = self.settings.absolute_m + self.settings.relative * self.amplitude_m();
        self.step.error(h, |element| sizes[element] * allowed_m)
    }

    /// The largest element of y at the ends of the step tried last, as a displacement.
    fn amplitude_m(&self) -> f64 {
        let ends = self.y.iter().zip(self.step.end());
        ends.zip(self.model.dynamics.sizes())
            .map(|((y, end), size)| y.abs().max(end.abs()) / size)
            .fold(0.0, f64::max)
    }

    fn accept(&mut self, h: f64, observe: &mut impl FnMut(&Segment<'_>)) -> Result<(), SimulateError> {
        if self.amplitude_m() > self.settings.largest_m {
            return Err(self.diverged());
        }
        observe(&Segment {
            model: self.model,
            contact: self.contact.as_ref(),
            quartics: &self.quartics,
            displacement: &self.displacement,
            within: self.within,
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
        self.room.state.copy_from_slice(&self.y);
        self.model.rate(
            Some(contact),
            self.within,
            self.t,
            &self.room.state,
            &mut self.room.rate,
        );
        let v = self.model.dynamics.velocity(&self.room.rate);
        contact.switch(self.t, x, v);
    }

    /// The next time at which the right-hand side is not smooth, or the end.
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

    /// Half the time from tooth to tooth: the surface in front must be there, and changes of contact be seen.
    fn longest_step(&self, end_s: f64) -> f64 {
        self.contact
            .as_ref()
            .map_or(end_s, |contact| 0.5 * contact.shortest_delay_s())
    }

    /// The step that leaves no stub before `stop_s`.
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

    /// Times closer than this cannot be told apart.
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
