//! Teeth in contact: who is in the arc of the cut, who has material, who touches it, and the force of it all.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use super::cutting::{Cutting, Regeneration};
use super::passage::Spans;
use super::surface::{Surface, TAKEN_AT};
use quietcut_model::cutter::{Immersion, Tooth};
use quietcut_numerics::crossing::first_below_zero;
use quietcut_numerics::dormand_prince::{Quartic, at};

/// A kink of the surface in a derivative above this leaves the order of the integrator as it is.
const SMOOTH_FROM: u8 = 5;

/// Times closer than this share of the time per pitch are the same time: rounding, not physics.
const SAME_TIME: f64 = 1e-9;

/// Contact is lost and found this far beyond the surface, as a share of the feed per tooth and at least in m: a chip
/// that ends in nothing, as in a slot, does not lose contact by errors of integration.
const NOTHING: f64 = 1e-7;
const NOTHING_M: f64 = 1e-15;

/// The state of all teeth.
#[derive(Clone, Debug)]
pub(super) struct Contact<'a> {
    cutting: &'a Cutting,
    teeth: Vec<State>,
    /// The stretch of time that is being looked at, shortened by rounding: see [`Surface::height_m`].
    within: [f64; 2],
    same_time_s: f64,
    longest_delay_s: f64,
    /// Derivatives by which a kink of the force is smoother in the displacement.
    gain_of_order: u8,
}

#[derive(Clone, Debug)]
struct State {
    /// Between the start and the exit angle.
    in_arc: bool,
    /// When it next enters or leaves the arc.
    next_switch_s: f64,
    /// Passes begun, counted from the spindle angle.
    pass: f64,
    spans: Spans,
    in_material: bool,
    /// The edge is at the surface; else it is off it, and the surface stays as it was left.
    at_surface: bool,
    /// When contact changed last: it can change only once at a time.
    changed_s: f64,
    surface: Surface,
    /// Kinks of the surface in front: when they come, and in which derivative.
    kinks: VecDeque<(f64, u8)>,
}

/// A chip as a tooth sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chip {
    /// Distance from the surface in front to the edge, m; negative off the surface.
    pub(super) thickness_m: f64,
    place: Immersion,
}

/// The first change of contact in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Change {
    /// The tooth.
    pub(super) tooth: usize,
    /// When, as a fraction of the step.
    pub(super) u: f64,
}

impl<'a> Contact<'a> {
    /// The teeth at t = 0; `velocity_jumps` as [`super::Dynamics::velocity_jumps`].
    pub(super) fn new(cutting: &'a Cutting, velocity_jumps: bool) -> Self {
        let cutter = &cutting.cutter;
        let shortest = cutter
            .teeth
            .iter()
            .map(|tooth| tooth.pitch_rad)
            .fold(TAU, f64::min);
        let longest = cutter
            .teeth
            .iter()
            .map(|tooth| tooth.pitch_rad)
            .fold(0.0, f64::max);
        let mut contact = Self {
            cutting,
            teeth: Vec::with_capacity(cutter.teeth.len()),
            within: [0.0; 2],
            same_time_s: SAME_TIME * cutting.spindle.bounds_s(shortest)[0],
            longest_delay_s: cutting.spindle.bounds_s(longest)[1],
            gain_of_order: if velocity_jumps { 1 } else { 2 },
        };
        for tooth in &cutter.teeth {
            contact.teeth.push(State::new());
            let angle = (cutting.spindle.angle_rad(0.0) + tooth.angle_rad - cutter.start_rad) / TAU;
            // A tooth that stands at the start angle enters now.
            let pass = (angle + SAME_TIME).floor();
            let index = contact.teeth.len() - 1;
            contact.teeth[index].pass = pass;
            let close_s = contact.close_s(index);
            if close_s > contact.same_time_s {
                contact.enter(index);
            } else {
                contact.teeth[index].pass += 1.0;
                contact.leave(index);
            }
        }
        for index in 0..contact.teeth.len() {
            contact.teeth[index].in_material = contact.teeth[index].spans.contain(contact.same_time_s);
        }
        // What was before t = 0 was another motion: the surface has a step there.
        contact.kink_of_motion(0.0, 0);
        contact
    }

    /// The smallest time from tooth to tooth: no step may be longer, the surface must be there.
    pub(super) fn shortest_delay_s(&self) -> f64 {
        self.same_time_s / SAME_TIME
    }

    /// Says which stretch of time is looked at next.
    pub(super) fn look_at(&mut self, from_s: f64, to_s: f64) {
        let inset = self.same_time_s.min(0.25 * (to_s - from_s));
        self.within = [from_s + inset, to_s - inset];
    }

    /// Force on the tool, N, at `t` with the tool displaced by `x`; without that of its velocity.
    pub(super) fn force_n(&self, t: f64, x: [f64; 3]) -> [f64; 3] {
        let cutter = &self.cutting.cutter;
        let depth_m = self.depth_m(t, x);
        let mut sum = [0.0; 3];
        for tooth in self.cutting_teeth() {
            let chip = self.chip(tooth, t, x);
            let depths_m = self.shares(tooth, t).map(|share| depth_m * share);
            let force = cutter.force.force_of_n(chip.place, chip.thickness_m, depths_m);
            for (sum, force) in sum.iter_mut().zip(force) {
                *sum += force;
            }
        }
        sum.map(|force| force * cutter.force.wear(t))
    }

    /// The matrix D, N s/m, of the force −D v of process damping at `t` with the tool displaced by `x`; `None` where there
    /// is none.
    pub(super) fn damping_ns_per_m(&self, t: f64, x: [f64; 3]) -> Option<[[f64; 3]; 3]> {
        let cutter = &self.cutting.cutter;
        cutter.force.process_damping?;
        let speed_m_per_s = cutter.radius_m? * self.cutting.spindle.speed_at_rad_per_s(t);
        let depth_m = self.depth_m(t, x);
        let mut sum = [[0.0; 3]; 3];
        for tooth in self.cutting_teeth() {
            // The flank presses towards the axis.
            let depth_m = depth_m * self.shares(tooth, t)[1];
            let damping = cutter
                .force
                .damping_ns_per_m(self.place(tooth, t), depth_m, speed_m_per_s);
            for (sum, damping) in sum.as_flattened_mut().iter_mut().zip(damping.as_flattened()) {
                *sum += damping * cutter.force.wear(t);
            }
        }
        Some(sum)
    }

    /// What of the depth counts where a tooth stands: see [`super::Pores`].
    fn shares(&self, tooth: &Tooth, t: f64) -> [f64; 3] {
        match &self.cutting.pores {
            Some(pores) => pores.met(&self.cutting.cutter, &self.cutting.spindle, tooth, t),
            None => [1.0; 3],
        }
    }

    /// The teeth that touch material.
    fn cutting_teeth(&self) -> impl Iterator<Item = &Tooth> {
        let teeth = self.cutting.cutter.teeth.iter().zip(&self.teeth);
        teeth
            .filter(|(_, state)| state.in_material && state.at_surface)
            .map(|(tooth, _)| tooth)
    }

    /// Axial depth at `t`, m.
    fn depth_m(&self, t: f64, x: [f64; 3]) -> f64 {
        let cutter = &self.cutting.cutter;
        cutter.depth_at_m(cutter.depth_m * self.cutting.passage.depth_share(t), x[2])
    }

    /// How far the tool feeds until a tooth passes where the one ahead of it did, m: the feed axis moves steadily, also
    /// where the spindle does not.
    fn feed_m(&self, tooth: &Tooth, t: f64) -> f64 {
        tooth.feed_m * self.cutting.spindle.delay_share(t, tooth.pitch_rad)
    }

    fn chip(&self, tooth: &Tooth, t: f64, x: [f64; 3]) -> Chip {
        let place = self.place(tooth, t);
        let cutter = &self.cutting.cutter;
        let thickness_m = if self.cutting.regeneration == Regeneration::None {
            let ahead = &cutter.teeth[tooth.ahead];
            let at_rest = cutter.reach_m(tooth, place, [0.0; 3]) - cutter.reach_m(ahead, place, [0.0; 3]);
            at_rest + cutter.recession_m(place, self.feed_m(tooth, t))
        } else {
            cutter.reach_m(tooth, place, x) - self.in_front_m(tooth, place, t)
        };
        Chip { thickness_m, place }
    }

    fn place(&self, tooth: &Tooth, t: f64) -> Immersion {
        self.cutting
            .cutter
            .immersion(self.cutting.spindle.angle_rad(t) + tooth.angle_rad)
    }

    /// Height of the surface in front of a tooth, receded by the feed since it was left, m.
    fn in_front_m(&self, tooth: &Tooth, place: Immersion, t: f64) -> f64 {
        let cutter = &self.cutting.cutter;
        let spindle = &self.cutting.spindle;
        let delay_s = spindle.delay_s(t, tooth.pitch_rad);
        let within = self.within.map(|end| end - spindle.delay_s(end, tooth.pitch_rad));
        let ahead = &cutter.teeth[tooth.ahead];
        let left = self.teeth[tooth.ahead]
            .surface
            .height_m(cutter, ahead, place, t - delay_s, within);
        left - cutter.recession_m(place, self.feed_m(tooth, t))
    }

    /// The first time after `t` at which a tooth enters or leaves, meets or loses material, or meets a kink.
    pub(super) fn next_switch_s(&self, t: f64) -> f64 {
        let after = t + self.same_time_s;
        let of_teeth = self.teeth.iter().map(|state| {
            let kink = state.kinks.front().map_or(f64::INFINITY, |kink| kink.0);
            state.next_switch_s.min(kink).min(state.spans.next_edge(after))
        });
        of_teeth
            .fold(f64::INFINITY, f64::min)
            .min(self.cutting.passage.next_knot(after))
    }

    /// Enters and leaves, at `t` where [`Self::next_switch_s`] has said; `x` and `v` are the motion of the tool.
    pub(super) fn switch(&mut self, t: f64, x: [f64; 3], v: [f64; 3]) {
        let now = t + self.same_time_s;
        let mut force_jumps = false;
        for index in 0..self.teeth.len() {
            let entered = self.switch_arc(index, now);
            let state = &mut self.teeth[index];
            let in_material = state.in_arc && state.spans.contain(now);
            force_jumps |= in_material != state.in_material || entered;
            state.in_material = in_material;
            if entered {
                state.at_surface = true;
            }
        }
        for index in 0..self.teeth.len() {
            self.pass_kinks(index, now);
        }
        if force_jumps {
            self.kink_of_force(t, 0);
            self.touch(t, x, v);
        }
    }

    /// True where the tooth entered the arc.
    fn switch_arc(&mut self, index: usize, now: f64) -> bool {
        let mut entered = false;
        while self.teeth[index].next_switch_s <= now {
            if self.teeth[index].in_arc {
                self.teeth[index].pass += 1.0;
                self.leave(index);
            } else {
                self.enter(index);
                entered = true;
            }
        }
        entered
    }

    fn open_s(&self, index: usize) -> f64 {
        let cutter = &self.cutting.cutter;
        let angle = cutter.start_rad - cutter.teeth[index].angle_rad + TAU * self.teeth[index].pass;
        self.cutting.spindle.time_s(angle)
    }

    fn close_s(&self, index: usize) -> f64 {
        let cutter = &self.cutting.cutter;
        let angle = cutter.exit_rad - cutter.teeth[index].angle_rad + TAU * self.teeth[index].pass;
        self.cutting.spindle.time_s(angle)
    }

    fn enter(&mut self, index: usize) {
        let (open_s, close_s) = (self.open_s(index), self.close_s(index));
        let cutting = self.cutting;
        let state = &mut self.teeth[index];
        state.in_arc = true;
        state.next_switch_s = close_s;
        state.spans = cutting
            .passage
            .spans(&cutting.cutter, &cutting.spindle, open_s, close_s);
    }

    /// Out of the arc until the pass that `pass` counts.
    fn leave(&mut self, index: usize) {
        let open_s = self.open_s(index);
        let state = &mut self.teeth[index];
        state.in_arc = false;
        state.in_material = false;
        state.next_switch_s = open_s;
        state.spans = Spans::default();
    }

    /// Teeth that have just entered: at the surface, or off it already?
    fn touch(&mut self, t: f64, x: [f64; 3], v: [f64; 3]) {
        if self.cutting.regeneration != Regeneration::AllPasses {
            return;
        }
        // Far enough for the slow growth of a chip from nothing to be seen, close enough for it to be linear.
        let soon_s = 1e-4 * self.shortest_delay_s();
        let then = std::array::from_fn(|axis| x[axis] + soon_s * v[axis]);
        self.look_at(t, t + soon_s);
        for (index, tooth) in self.cutting.cutter.teeth.iter().enumerate() {
            let open_s = self.open_s(index);
            if self.teeth[index].in_arc && (t - open_s).abs() <= self.same_time_s {
                self.teeth[index].at_surface = self.chip(tooth, t + soon_s, then).thickness_m >= 0.0;
            }
        }
    }

    /// The first change of contact in the step from `t` to `t + h` with the tool moving along `displacement`.
    pub(super) fn first_change(&self, t: f64, h: f64, displacement: &[Quartic; 3]) -> Option<Change> {
        if self.cutting.regeneration != Regeneration::AllPasses
            || self
                .cutting
                .passage
                .is_over(t, &self.cutting.cutter, &self.cutting.spindle)
        {
            return None;
        }
        let changes = (0..self.teeth.len()).filter_map(|index| {
            let state = &self.teeth[index];
            state
                .in_arc
                .then(|| self.change_of(index, t, h, displacement))
                .flatten()
        });
        changes.min_by(|a, b| a.u.total_cmp(&b.u))
    }

    fn change_of(&self, index: usize, t: f64, h: f64, displacement: &[Quartic; 3]) -> Option<Change> {
        let tooth = &self.cutting.cutter.teeth[index];
        let sign = if self.teeth[index].at_surface { 1.0 } else { -1.0 };
        let nothing_m = (NOTHING * self.cutting.cutter.feed_per_tooth_m).max(NOTHING_M);
        // Positive while contact stays as it is.
        let margin = |u: f64| {
            let x = std::array::from_fn(|axis| at(&displacement[axis], u));
            sign * self.chip(tooth, t + u * h, x).thickness_m + nothing_m
        };
        first_below_zero(margin).map(|u| Change { tooth: index, u })
    }

    /// Contact of a tooth changes at `t`. `false` where it has changed at this very time before: then neither
    /// contact nor air is a motion that goes on.
    pub(super) fn change(&mut self, index: usize, t: f64) -> bool {
        let jumps = self.cutting.cutter.force.jumps_at_contact();
        let again = (t - self.teeth[index].changed_s).abs() <= self.same_time_s * 1e-3;
        let state = &mut self.teeth[index];
        state.at_surface = !state.at_surface;
        state.changed_s = t;
        if state.in_material {
            self.kink_of_force(t, if jumps { 0 } else { 1 });
        }
        self.kink_behind(index, t, 1);
        !again
    }

    /// Records the step from `t` to `t + h` in the surfaces.
    pub(super) fn record(&mut self, t: f64, h: f64, displacement: &[Quartic; 3]) {
        let forget_before = t - 1.5 * self.longest_delay_s;
        for index in 0..self.teeth.len() {
            if !self.teeth[index].in_arc {
                continue;
            }
            if self.teeth[index].at_surface {
                self.teeth[index].surface.push_cut(t, t + h, *displacement);
            } else {
                let tooth = &self.cutting.cutter.teeth[index];
                let heights = TAKEN_AT.map(|u| {
                    let t = t + u * h;
                    self.in_front_m(tooth, self.place(tooth, t), t)
                });
                self.teeth[index].surface.push_left(t, t + h, heights);
            }
            self.teeth[index].surface.forget_before(forget_before);
        }
    }

    /// The force has a jump in its derivative `order`: so has, some orders higher, the surface that is being cut.
    fn kink_of_force(&mut self, t: f64, order: u8) {
        self.kink_of_motion(t, order + self.gain_of_order);
    }

    fn kink_of_motion(&mut self, t: f64, order: u8) {
        for index in 0..self.teeth.len() {
            if self.teeth[index].in_arc && self.teeth[index].at_surface {
                self.kink_behind(index, t, order);
            }
        }
    }

    /// The surface that tooth `index` leaves has a kink: the tooth behind will meet it.
    fn kink_behind(&mut self, index: usize, t: f64, order: u8) {
        if order >= SMOOTH_FROM {
            return;
        }
        let behind = self.cutting.cutter.teeth[index].behind;
        let when = t + self
            .cutting
            .spindle
            .advance_s(t, self.cutting.cutter.teeth[behind].pitch_rad);
        let kinks = &mut self.teeth[behind].kinks;
        match kinks.back_mut() {
            Some(kink) if (kink.0 - when).abs() <= self.same_time_s => kink.1 = kink.1.min(order),
            _ => kinks.push_back((when, order)),
        }
    }

    /// A tooth meets the kinks that are due.
    fn pass_kinks(&mut self, index: usize, now: f64) {
        while let Some((when, order)) = self.teeth[index]
            .kinks
            .front()
            .copied()
            .filter(|kink| kink.0 <= now)
        {
            self.teeth[index].kinks.pop_front();
            let state = &self.teeth[index];
            if !state.in_arc {
                continue;
            }
            if !state.at_surface {
                self.kink_behind(index, when, order);
            } else if state.in_material {
                self.kink_of_force(when, order);
            }
        }
    }
}

impl State {
    fn new() -> Self {
        Self {
            in_arc: false,
            next_switch_s: f64::INFINITY,
            pass: 0.0,
            spans: Spans::default(),
            in_material: false,
            at_surface: true,
            changed_s: f64::NEG_INFINITY,
            surface: Surface::default(),
            kinks: VecDeque::new(),
        }
    }
}
