//! Memory of a Masing loop: the turning points of the path of an element with a backbone g(u).
//!
//! The element follows its backbone g(x) from rest on. After a turning point (x_t, g_t) it follows
//! g_t + 2·g((x − x_t)/2), until the path comes back to the turning point before: that loop is then closed and
//! forgotten. Beyond the largest displacement so far it follows the backbone again (Masing's rules). For a sum of
//! elastic sliders in parallel (Iwan) these rules are exact.
//!
//! The internal states hold up to [`POINTS`] turning points. If there are more, as in a long decay, the memory forgets
//! the pair of successive points without which the path changes least: the force on the present branch stays exact, and
//! jumps by that change if a later motion comes back to the forgotten loop.

/// Number of turning points in memory. A choice.
pub(super) const POINTS: usize = 16;

/// Number of internal states: displacements of the turning points, m, the first with the largest absolute value; g, m,
/// at all but the first, which is on the backbone; the displacement at the last sample of a given motion, m. Unused
/// places repeat the last turning point; without turning points the first place is 0.
pub(super) const STATES: usize = 2 * POINTS;

/// Index of the displacement at the last sample.
const LAST: usize = STATES - 1;

/// Distance from a turning point, relative to the size of its loop, within which the path counts as being there.
const ROUNDING: f64 = 1e-9;

/// The backbone g(u) of an element: an odd function, m.
pub(super) type Backbone<'a> = &'a dyn Fn(f64) -> f64;

/// The branch of the path after the last turning point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Branch {
    /// Displacement and g at the turning point, m, and the displacement at which the branch closes its loop, m; `None`
    /// on the backbone.
    from: Option<(f64, f64, f64)>,
}

impl Branch {
    /// The present branch.
    pub(super) fn of(own: &[f64], backbone: Backbone<'_>) -> Self {
        Self::at_depth(own, depth(own), backbone)
    }

    fn at_depth(own: &[f64], depth: usize, backbone: Backbone<'_>) -> Self {
        let from = match depth {
            0 => None,
            1 => Some((own[0], backbone(own[0]), -own[0])),
            _ => Some((own[depth - 1], own[POINTS + depth - 2], own[depth - 2])),
        };
        Self { from }
    }

    /// g at the displacement `x`, m, of this branch.
    pub(super) fn value(&self, x: f64, backbone: Backbone<'_>) -> f64 {
        match self.from {
            None => backbone(x),
            Some((turned_m, value, _)) => value + 2.0 * backbone(0.5 * (x - turned_m)),
        }
    }

    /// Distance from the displacement `x` to the closure of the loop, m; negative beyond it, infinite on the backbone.
    pub(super) fn left_m(&self, x: f64) -> f64 {
        self.from.map_or(f64::INFINITY, |(turned_m, _, closes_m)| {
            (closes_m - x) * (closes_m - turned_m).signum()
        })
    }

    /// True if a path at `x` that moves to the side `forward` stays on this branch.
    fn continues(&self, x: f64, forward: bool) -> bool {
        match self.from {
            None => x == 0.0 || (x > 0.0) == forward,
            Some((turned_m, _, closes_m)) => (closes_m > turned_m) == forward,
        }
    }
}

/// Number of turning points in memory.
fn depth(own: &[f64]) -> usize {
    if own[0] == 0.0 {
        return 0;
    }
    1 + (1..POINTS)
        .take_while(|place| own[*place] != own[place - 1])
        .count()
}

/// Number of turning points that remain at the displacement `x`, once closed loops are forgotten.
fn remaining(own: &[f64], x: f64) -> usize {
    let mut depth = depth(own);
    while depth > 0 {
        if x.abs() >= own[0].abs() * (1.0 - ROUNDING) {
            return 0;
        }
        if depth == 1 {
            break;
        }
        let (turned_m, closes_m) = (own[depth - 1], own[depth - 2]);
        let share = (x - turned_m) / (closes_m - turned_m);
        if share <= ROUNDING {
            depth -= 1;
        } else if share >= 1.0 - ROUNDING {
            depth -= 2;
        } else {
            break;
        }
    }
    depth
}

/// Keeps the first `depth` turning points.
fn truncate(own: &mut [f64], depth: usize) {
    let last = if depth == 0 { 0.0 } else { own[depth - 1] };
    own[depth..POINTS].fill(last);
}

/// Sets the memory at the first sample of a given motion: a path that moves away from rest is on the backbone, any other
/// turned at this sample, which holds for a structure that is let go.
pub(super) fn begin(own: &mut [f64], x: f64, v: f64) {
    own.fill(0.0);
    if x * v <= 0.0 {
        own[..POINTS].fill(x);
    }
    own[LAST] = x;
}

/// Updates the memory at the displacement `x`, from which the path moves to the side `forward`.
pub(super) fn turn(own: &mut [f64], x: f64, forward: bool, backbone: Backbone<'_>) {
    let depth = remaining(own, x);
    truncate(own, depth);
    let branch = Branch::at_depth(own, depth, backbone);
    if !branch.continues(x, forward) {
        push(own, depth, [x, branch.value(x, backbone)], backbone);
    }
}

/// Updates the memory to the next sample `x` of a given motion.
pub(super) fn follow(own: &mut [f64], x: f64, backbone: Backbone<'_>) {
    let before = own[LAST];
    if x == before {
        return;
    }
    turn(own, before, x > before, backbone);
    let depth = remaining(own, x);
    truncate(own, depth);
    own[LAST] = x;
}

/// Adds a turning point [x, g] to the memory of `depth` turning points; a full memory first forgets two.
fn push(own: &mut [f64], mut depth: usize, point: [f64; 2], backbone: Backbone<'_>) {
    if depth == POINTS {
        let first = least_missed(own, point, backbone);
        own.copy_within(first + 2..POINTS, first);
        // The values begin with the second point.
        let to = POINTS + first.max(1) - 1;
        own.copy_within(to + 2..LAST, to);
        depth -= 2;
    }
    own[depth..POINTS].fill(point[0]);
    if depth > 0 {
        own[POINTS + depth - 1] = point[1];
    }
}

/// The first of two successive turning points without which the path comes back to the next one, at the latest the new
/// `point`, with the least error of g.
fn least_missed(own: &[f64], point: [f64; 2], backbone: Backbone<'_>) -> usize {
    let at = |place: usize| match place {
        0 => [own[0], backbone(own[0])],
        POINTS => point,
        _ => [own[place], own[POINTS + place - 1]],
    };
    let missed = |first: usize| {
        let [x, value] = at(first + 2);
        let without = match first.checked_sub(1).map(at) {
            None => backbone(x),
            Some([turned_m, turned]) => turned + 2.0 * backbone(0.5 * (x - turned_m)),
        };
        (value - without).abs()
    };
    (0..POINTS - 1)
        .min_by(|a, b| missed(*a).total_cmp(&missed(*b)))
        .unwrap_or(0)
}
