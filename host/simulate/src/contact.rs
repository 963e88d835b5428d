//! Contact of the teeth with the workpiece, chip thickness, and the cutting force of all teeth.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use super::criteria::{CONTACT_DECIDED, CONTACT_TOLERANCE, CONTACT_TOLERANCE_MIN_M};
use super::cutting::{Cutting, Regeneration};
use super::surface::{SURFACE_NODES, Surface};
use super::workpiece_traverse::MaterialWindows;
use quietcut_model::cutter::{Immersion, Tooth};
use quietcut_numerics::crossing::first_below_zero;
use quietcut_numerics::dormand_prince::{Quartic, at};

/// Order of the discontinuous derivative of a machined surface from which on an integration step need not end there:
/// the discontinuity does not lower the order of an integrator of order 5.
const SMOOTH_FROM: u8 = 5;

/// Two instants closer than this fraction of the shortest tooth-passing period count as equal. Rounding of the time,
/// 2.2e-16 of it, stays below this for 4 million periods; entries and exits of milling are much further apart.
const SAME_TIME: f64 = 1e-9;

/// State of contact of all teeth with the workpiece, and the machined surfaces that the teeth leave.
#[derive(Clone, Debug)]
pub(super) struct Contact<'a> {
    cutting: &'a Cutting,
    teeth: Vec<ToothState>,
    /// Start and end of the integration step that is evaluated, s, moved inwards by a rounding margin: see
    /// [`Surface::height_m`].
    within: [f64; 2],
    same_time_s: f64,
    longest_delay_s: f64,
    /// Order of the displacement's discontinuous derivative minus that of the force's: 2, or 1 if the velocity jumps
    /// with the force.
    gain_of_order: u8,
}

#[derive(Clone, Debug)]
/// State of contact of one tooth.
struct ToothState {
    /// True while the tooth is between the start angle and the exit angle of the cut (engagement arc).
    in_arc: bool,
    /// Time of the tooth's next entry into, or exit from, the engagement arc, s.
    next_switch_s: f64,
    /// Number of the tooth's present passing through the engagement arc, or of its next one while it is outside; one
    /// per revolution.
    pass: f64,
    windows: MaterialWindows,
    in_material: bool,
    /// True if the edge of the tooth in the arc counts as in contact with the surface in front; otherwise that surface
    /// persists. Unchanged while the tooth is outside the arc.
    at_surface: bool,
    /// Time of the last [`Contact::change`] of the tooth, s; −∞ before the first.
    changed_s: f64,
    surface: Surface,
    /// Kinks of the machined surface in front of the tooth that it has not yet met, in the order of time: time at which
    /// the tooth meets the kink, s, and order of the lowest derivative of the surface's height over time that is
    /// discontinuous there.
    kinks: VecDeque<(f64, u8)>,
}

/// Chip thickness of one tooth at one instant.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chip {
    /// Chip thickness, m: distance from the surface in front to the edge, negative if the edge does not reach it; with
    /// [`Regeneration::None`] that of feed and runout.
    pub(super) thickness_m: f64,
    immersion: Immersion,
}

/// The first loss or regain of contact by a tooth in an integration step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Change {
    /// Index of the tooth.
    pub(super) tooth: usize,
    /// Time of the change of contact as a fraction of the integration step.
    pub(super) u: f64,
}

impl<'a> Contact<'a> {
    /// State of contact of the teeth at t = 0, for a tool that was at rest before; `velocity_jumps` as in
    /// [`super::Dynamics::velocity_jumps`].
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
            contact.teeth.push(ToothState::new());
            let angle = (cutting.spindle.angle_rad(0.0) + tooth.angle_rad - cutter.start_rad) / TAU;
            // A tooth at the start angle, within rounding, enters the engagement arc at t = 0.
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
            contact.teeth[index].in_material = contact.teeth[index].windows.contain(contact.same_time_s);
        }
        // The machined surface may have a step at t = 0: before that time a tool at rest left it.
        contact.kink_of_motion(0.0, 0);
        contact
    }

    /// Shortest tooth-passing period, s: a longer step would need a surface that is not yet computed.
    pub(super) fn shortest_delay_s(&self) -> f64 {
        self.same_time_s / SAME_TIME
    }

    /// Sets the integration step, from `from_s` to `to_s`, that is evaluated next.
    pub(super) fn set_step(&mut self, from_s: f64, to_s: f64) {
        let inset = self.same_time_s.min(0.25 * (to_s - from_s));
        self.within = [from_s + inset, to_s - inset];
    }

    /// Cutting force of all teeth on the tool, N, at the time `t`, s, and displacement `x`, m; with wear, without
    /// process damping.
    pub(super) fn force_n(&self, t: f64, x: [f64; 3]) -> [f64; 3] {
        let cutter = &self.cutting.cutter;
        let depth_m = self.depth_m(t, x);
        let mut sum = [0.0; 3];
        for tooth in self.cutting_teeth() {
            let chip = self.chip(tooth, t, x);
            let depths_m = self.shares(tooth, t).map(|share| depth_m * share);
            let force = cutter
                .force
                .force_of_n(chip.immersion, chip.thickness_m, depths_m);
            for (sum, force) in sum.iter_mut().zip(force) {
                *sum += force;
            }
        }
        sum.map(|force| force * cutter.force.wear(t))
    }

    /// Matrix D, N s/m, of the process damping force −D v at the time `t` and displacement `x`; `None` without process
    /// damping or tool diameter.
    pub(super) fn damping_ns_per_m(&self, t: f64, x: [f64; 3]) -> Option<[[f64; 3]; 3]> {
        let cutter = &self.cutting.cutter;
        cutter.force.process_damping?;
        let speed_m_per_s = cutter.radius_m? * self.cutting.spindle.speed_at_rad_per_s(t);
        let depth_m = self.depth_m(t, x);
        let mut sum = [[0.0; 3]; 3];
        for tooth in self.cutting_teeth() {
            // The radial factor on the axial depth is taken for the whole flank force, its tangential friction
            // included.
            let depth_m = depth_m * self.shares(tooth, t)[1];
            let damping = cutter
                .force
                .damping_ns_per_m(self.immersion(tooth, t), depth_m, speed_m_per_s);
            for (sum, damping) in sum.as_flattened_mut().iter_mut().zip(damping.as_flattened()) {
                *sum += damping * cutter.force.wear(t);
            }
        }
        Some(sum)
    }

    /// Factors on the axial depth in tangential, radial and axial force at the location of a tooth in porous material,
    /// see [`super::Pores`]; 1 in solid material.
    fn shares(&self, tooth: &Tooth, t: f64) -> [f64; 3] {
        match &self.cutting.pores {
            Some(pores) => pores.at_tooth(&self.cutting.cutter, &self.cutting.spindle, tooth, t),
            None => [1.0; 3],
        }
    }

    /// The teeth that have material in front of them and are in contact.
    fn cutting_teeth(&self) -> impl Iterator<Item = &Tooth> {
        let teeth = self.cutting.cutter.teeth.iter().zip(&self.teeth);
        teeth
            .filter(|(_, state)| state.in_material && state.at_surface)
            .map(|(tooth, _)| tooth)
    }

    /// Axial depth of cut, m, at the time `t` and displacement `x`.
    fn depth_m(&self, t: f64, x: [f64; 3]) -> f64 {
        let cutter = &self.cutting.cutter;
        cutter.depth_at_m(cutter.depth_m * self.cutting.traverse.depth_share(t), x[2])
    }

    /// Feed, m, during the regenerative delay of `tooth` at the time `t`. The feed axis moves at constant speed even if
    /// the spindle speed varies.
    fn feed_m(&self, tooth: &Tooth, t: f64) -> f64 {
        tooth.feed_m * self.cutting.spindle.delay_share(t, tooth.pitch_rad)
    }

    fn chip(&self, tooth: &Tooth, t: f64, x: [f64; 3]) -> Chip {
        let immersion = self.immersion(tooth, t);
        let cutter = &self.cutting.cutter;
        let thickness_m = if self.cutting.regeneration == Regeneration::None {
            let ahead = &cutter.teeth[tooth.ahead];
            let at_rest =
                cutter.reach_m(tooth, immersion, [0.0; 3]) - cutter.reach_m(ahead, immersion, [0.0; 3]);
            at_rest + cutter.recession_m(immersion, self.feed_m(tooth, t))
        } else {
            cutter.reach_m(tooth, immersion, x) - self.surface_in_front_m(tooth, immersion, t)
        };
        Chip {
            thickness_m,
            immersion,
        }
    }

    fn immersion(&self, tooth: &Tooth, t: f64) -> Immersion {
        self.cutting
            .cutter
            .immersion(self.cutting.spindle.angle_rad(t) + tooth.angle_rad)
    }

    /// Height of the surface in front of a tooth, m: that of the surface which the tooth ahead left, minus the
    /// contribution of the feed during the regenerative delay.
    fn surface_in_front_m(&self, tooth: &Tooth, immersion: Immersion, t: f64) -> f64 {
        let cutter = &self.cutting.cutter;
        let spindle = &self.cutting.spindle;
        let delay_s = spindle.delay_s(t, tooth.pitch_rad);
        let within = self.within.map(|end| end - spindle.delay_s(end, tooth.pitch_rad));
        let ahead = &cutter.teeth[tooth.ahead];
        let left = self.teeth[tooth.ahead]
            .surface
            .height_m(cutter, ahead, immersion, t - delay_s, within);
        left - cutter.recession_m(immersion, self.feed_m(tooth, t))
    }

    /// The first time after `t`, s, at which a tooth enters or leaves the engagement arc or the material, or meets a
    /// kink of the machined surface, or at which the rate of the axial depth over the traverse jumps.
    pub(super) fn next_switch_s(&self, t: f64) -> f64 {
        let after = t + self.same_time_s;
        let of_teeth = self.teeth.iter().map(|state| {
            let kink = state.kinks.front().map_or(f64::INFINITY, |kink| kink.0);
            state.next_switch_s.min(kink).min(state.windows.next_edge(after))
        });
        of_teeth
            .fold(f64::INFINITY, f64::min)
            .min(self.cutting.traverse.next_knot(after))
    }

    /// Applies the entries and exits of the teeth, and the kinks of the machined surfaces, at the time `t` of
    /// [`Self::next_switch_s`]; `x`, m, and `v`, m/s, are the motion of the tool.
    pub(super) fn switch(&mut self, t: f64, x: [f64; 3], v: [f64; 3]) {
        let now = t + self.same_time_s;
        let mut force_jumps = false;
        for index in 0..self.teeth.len() {
            let entered = self.switch_arc(index, now);
            let state = &mut self.teeth[index];
            let in_material = state.in_arc && state.windows.contain(now);
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
            self.decide_contact_after_entry(t, x, v);
        }
    }

    /// Moves a tooth into or out of the engagement arc if its entry or exit is not after the time `now`, s; true if it
    /// entered.
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
        state.windows = cutting
            .traverse
            .windows(&cutting.cutter, &cutting.spindle, open_s, close_s);
    }

    /// Moves a tooth out of the engagement arc; its next entry is that of tooth passing number `pass`.
    fn leave(&mut self, index: usize) {
        let open_s = self.open_s(index);
        let state = &mut self.teeth[index];
        state.in_arc = false;
        state.in_material = false;
        state.next_switch_s = open_s;
        state.windows = MaterialWindows::default();
    }

    /// Decides for each tooth that has just entered the engagement arc whether it is in contact, from the sign of its
    /// chip thickness shortly afterwards. Without [`Regeneration::AllPasses`] all stay in contact.
    fn decide_contact_after_entry(&mut self, t: f64, x: [f64; 3], v: [f64; 3]) {
        if self.cutting.regeneration != Regeneration::AllPasses {
            return;
        }
        let soon_s = CONTACT_DECIDED * self.shortest_delay_s();
        let then = std::array::from_fn(|axis| x[axis] + soon_s * v[axis]);
        self.set_step(t, t + soon_s);
        for (index, tooth) in self.cutting.cutter.teeth.iter().enumerate() {
            let open_s = self.open_s(index);
            if self.teeth[index].in_arc && (t - open_s).abs() <= self.same_time_s {
                self.teeth[index].at_surface = self.chip(tooth, t + soon_s, then).thickness_m >= 0.0;
            }
        }
    }

    /// The first loss or regain of contact detected in the step from `t` to `t + h`, s, while the tool moves along
    /// `displacement`. `None` if there is none, if the tool has left the workpiece for good, and without
    /// [`Regeneration::AllPasses`].
    pub(super) fn first_change(&self, t: f64, h: f64, displacement: &[Quartic; 3]) -> Option<Change> {
        if self.cutting.regeneration != Regeneration::AllPasses
            || self
                .cutting
                .traverse
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
        let tolerance_m =
            (CONTACT_TOLERANCE * self.cutting.cutter.feed_per_tooth_m).max(CONTACT_TOLERANCE_MIN_M);
        // Chip thickness, m, with a sign that makes it positive in the present state of contact, plus the tolerance of
        // contact: negative once the contact changes.
        let margin = |u: f64| {
            let x = std::array::from_fn(|axis| at(&displacement[axis], u));
            sign * self.chip(tooth, t + u * h, x).thickness_m + tolerance_m
        };
        first_below_zero(margin).map(|u| Change { tooth: index, u })
    }

    /// Changes the contact of a tooth at the time `t`. False if its last change was at the same time; several such
    /// changes in succession show that it can neither keep nor lose contact.
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

    /// Appends the accepted step from `t` to `t + h`, s, to the surfaces of all teeth in the arc, and removes their
    /// pieces that are no longer needed.
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
                let heights = SURFACE_NODES.map(|u| {
                    let t = t + u * h;
                    self.surface_in_front_m(tooth, self.immersion(tooth, t), t)
                });
                self.teeth[index].surface.push_uncut(t, t + h, heights);
            }
            self.teeth[index].surface.forget_before(forget_before);
        }
    }

    /// Notes that derivative `order` of the force is discontinuous at the time `t`, s: the surfaces that are being cut
    /// then have a kink in derivative `order` + `gain_of_order`.
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

    /// Notes a kink, at the time `t`, s, in derivative `order` of the surface that tooth `index` leaves: the next tooth
    /// meets it one regenerative delay later. Orders from [`SMOOTH_FROM`] on are ignored.
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

    /// Removes the kinks of the surface in front of tooth `index` that the tooth meets up to the time `now`, s, and
    /// passes on those met in the arc: out of contact to the surface that the tooth leaves, in contact with material to
    /// the force and so to all surfaces being cut.
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

impl ToothState {
    fn new() -> Self {
        Self {
            in_arc: false,
            next_switch_s: f64::INFINITY,
            pass: 0.0,
            windows: MaterialWindows::default(),
            in_material: false,
            at_surface: true,
            changed_s: f64::NEG_INFINITY,
            surface: Surface::default(),
            kinks: VecDeque::new(),
        }
    }
}
