//! Roots and minima of functions of one real variable: bisection, Newton's method with a bracket, regula falsi, golden
//! section.

/// Narrows the bracket [below, above] of a root, with finite ends, by bisection, until it is no wider than `width`, or
/// until no number lies between its ends.
///
/// The condition `is_below` is true at the first end and false at the second; either end may be the larger number. With
/// `width` 0 the ends that are returned are neighbouring numbers.
///
/// ```
/// use quietcut_numerics::roots::bisection;
///
/// let [below, above] = bisection([0.0, 2.0], 0.0, |x| x * x < 2.0);
/// assert!(below * below < 2.0 && above * above >= 2.0);
/// assert!(above - below <= f64::EPSILON * above);
/// ```
pub fn bisection(
    [mut below, mut above]: [f64; 2],
    width: f64,
    mut is_below: impl FnMut(f64) -> bool,
) -> [f64; 2] {
    while (above - below).abs() > width {
        let middle = 0.5 * (below + above);
        if middle == below || middle == above || middle.is_nan() {
            break;
        }
        if is_below(middle) {
            below = middle;
        } else {
            above = middle;
        }
    }
    [below, above]
}

/// Largest number of steps of [`monotone`]. Bisection alone needs about 52 to reduce the bracket to rounding.
const STEPS_MAX: usize = 100;

/// Root of an increasing function in [low, high] by Newton's method from `start`, in which bisection of the bracket
/// replaces a step that does not end inside it.
///
/// `function` returns value and derivative. The search ends after a step of at most 2 ε · max(|x|, (high − low)/2),
/// with the given bracket and the machine precision ε, or after 100 steps.
pub fn monotone([mut low, mut high]: [f64; 2], start: f64, function: impl Fn(f64) -> [f64; 2]) -> f64 {
    let reach = 0.5 * (high - low);
    let mut x = start;
    for _ in 0..STEPS_MAX {
        let [value, slope] = function(x);
        if value > 0.0 {
            high = x;
        } else {
            low = x;
        }
        let newton = x - value / slope;
        let next = if newton > low && newton < high {
            newton
        } else {
            0.5 * (low + high)
        };
        let step = (next - x).abs();
        x = next;
        if step <= 2.0 * f64::EPSILON * x.abs().max(reach) {
            break;
        }
    }
    x
}

/// Bracket of a sign change of a function, narrowed by regula falsi with the weights of Anderson and Björck (BIT 13
/// (1973) 253).
///
/// The caller evaluates the function at [`Self::next`] and passes the value to [`Self::narrow`], so that an evaluation
/// may fail or have further results. The order of convergence is about 1.7. If four evaluations have not halved the
/// bracket, the next one bisects it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignChange {
    ends: [[f64; 2]; 2],
    /// Index of the end of the bracket that the last step replaced; `None` before the first step.
    replaced: Option<usize>,
    /// Width of the bracket when it was last halved, or at the start before that, and number of evaluations of the
    /// function since then.
    halved: (f64, usize),
}

/// Number of evaluations of the function without a halving of the bracket after which the bracket is bisected.
const EVALUATIONS_PER_HALVING: usize = 4;

impl SignChange {
    /// Bracket between two points (x, f(x)) of a function f whose values differ in sign.
    pub fn new(first: [f64; 2], second: [f64; 2]) -> Self {
        Self {
            ends: [first, second],
            replaced: None,
            halved: ((second[0] - first[0]).abs(), 0),
        }
    }

    /// The argument at which the function is to be evaluated next.
    pub fn next(&self) -> f64 {
        let [[a, fa], [b, fb]] = self.ends;
        let x = a + (b - a) * fa / (fa - fb);
        // The secant through both ends, of which one value may be reduced, has its root at x. Rounding may place x
        // outside the bracket, and equal values have no such root: then the bracket is bisected, as after four
        // evaluations without a halving.
        if self.halved.1 < EVALUATIONS_PER_HALVING && (a.min(b)..=a.max(b)).contains(&x) {
            x
        } else {
            0.5 * (a + b)
        }
    }

    /// Replaces the end of the bracket whose value has the sign of `value` by the point (`x`, `value`); a `value` of 0
    /// counts as negative. Returns the index of that end, 0 or 1.
    pub fn narrow(&mut self, x: f64, value: f64) -> usize {
        let index = usize::from((value > 0.0) != (self.ends[0][1] > 0.0));
        if self.replaced == Some(index) {
            // The other end of the bracket has stayed for at least two steps. Its value is reduced, since regula falsi
            // would otherwise converge slowly.
            let gained = 1.0 - value / self.ends[index][1];
            self.ends[1 - index][1] *= if gained > 0.0 { gained } else { 0.5 };
        }
        self.replaced = Some(index);
        self.ends[index] = [x, value];
        self.halved = if self.width() <= 0.5 * self.halved.0 {
            (self.width(), 0)
        } else {
            (self.halved.0, self.halved.1 + 1)
        };
        index
    }

    /// The arguments x of both ends of the bracket, in the order in which they were given.
    pub fn ends(&self) -> [f64; 2] {
        self.ends.map(|[x, _]| x)
    }

    /// Width of the bracket: distance between its ends.
    pub fn width(&self) -> f64 {
        (self.ends[1][0] - self.ends[0][0]).abs()
    }
}

/// Ratio of the widths of successive brackets in a golden-section search, (√5 − 1)/2.
const GOLDEN: f64 = 0.618_033_988_749_894_8;

/// Argument of the minimum of a function with a single minimum in [from, to], by golden-section search (Kiefer, Proc.
/// AMS 4 (1953) 502) until the bracket is no wider than `width` or reaches rounding.
///
/// Returns the middle of the last bracket. Rounding of the function usually limits the accuracy to about the square
/// root of the machine precision.
pub fn minimum([mut from, mut to]: [f64; 2], width: f64, function: impl Fn(f64) -> f64) -> f64 {
    let (mut left, mut right) = (to - GOLDEN * (to - from), from + GOLDEN * (to - from));
    let (mut at_left, mut at_right) = (function(left), function(right));
    while to - from > width && from < left && left < right && right < to {
        if at_left < at_right {
            (to, right, at_right) = (right, left, at_left);
            left = to - GOLDEN * (to - from);
            at_left = function(left);
        } else {
            (from, left, at_left) = (left, right, at_right);
            right = from + GOLDEN * (to - from);
            at_right = function(right);
        }
    }
    0.5 * (from + to)
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    #[test]
    fn bisection_ends_between_neighbouring_numbers_in_either_order() {
        let exact = 0.3_f64.exp();
        for ends in [[0.0, 5.0], [-1e300, 1e300], [1.3, 1.4]] {
            let [below, above] = bisection(ends, 0.0, |x| x < exact);
            assert!(below < exact && above >= exact && above.next_down() <= below);
        }
        let [above, below] = bisection([5.0, 0.0], 0.0, |x| x > exact);
        assert!(below <= exact && above > exact);
        let [below, above] = bisection([0.0, 5.0], 1e-3, |x| x < exact);
        assert!(above - below <= 1e-3 && below < exact && exact <= above);
        // Not a number: returns.
        bisection([0.0, f64::NAN], 0.0, |_| true);
        bisection([0.0, f64::INFINITY], 0.0, |_| true);
    }

    #[test]
    fn a_monotone_function_is_inverted_where_newton_alone_diverges() {
        let seed = 3;
        println!("seed {seed}");
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        for _ in 0..200 {
            let exact = rng.random_range(-20.0_f64..20.0);
            let function = |x: f64| [x.atan() - exact.atan(), 1.0 / (1.0 + x * x)];
            let found = monotone([-30.0, 30.0], 29.0, function);
            // The arctangent is flat far out: its rounding 1e-16 is 1e-16 · (1 + x²) of the argument.
            assert!((found - exact).abs() < 1e-13 * (1.0 + exact * exact), "{exact}");
        }
    }

    #[test]
    fn regula_falsi_encloses_and_is_fast() {
        let seed = 5;
        println!("seed {seed}");
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        for _ in 0..200 {
            let exact = rng.random_range(0.05_f64..1.95);
            // Strongly bent: plain regula falsi keeps one end.
            let function = |x: f64| x.powi(9) - exact.powi(9);
            let mut bracket = SignChange::new([0.0, function(0.0)], [2.0, function(2.0)]);
            let mut steps = 0;
            while bracket.width() > 1e-12 {
                let x = bracket.next();
                let value = function(x);
                bracket.narrow(x, value);
                steps += 1;
                let [low, high] = bracket.ends();
                assert!(low <= exact + 1e-12 && exact <= high + 1e-12);
                if value == 0.0 {
                    break;
                }
            }
            // 41 halvings alone reach this width; each takes five evaluations at most.
            assert!(steps < 100, "{exact}: {steps}");
            // A nearly straight function takes a few steps.
            let function = |x: f64| x.exp() - exact.exp();
            let mut bracket = SignChange::new([0.0, function(0.0)], [2.0, function(2.0)]);
            for _ in 0..9 {
                let x = bracket.next();
                bracket.narrow(x, function(x));
            }
            let near = bracket.ends().map(|x| (x - exact).abs());
            assert!(near[0].min(near[1]) < 1e-13, "{exact}: {near:?}");
        }
    }

    #[test]
    fn a_minimum_is_found_with_one_evaluation_per_step() {
        let count = std::cell::Cell::new(0);
        let found = minimum([-1.0, 4.0], 1e-6, |x| {
            count.set(count.get() + 1);
            (x - 0.7).powi(2)
        });
        assert!((found - 0.7).abs() < 1e-6);
        // 5 · 0.618ⁿ = 1e-6: n = 33.
        assert!(count.get() < 40);
        // A minimum at an end, and a width of 0.
        assert!(minimum([1.0, 2.0], 0.0, |x| x) - 1.0 < 1e-12);
    }
}
