//! Rates that a document or an interval claims, against what a campaign or a slice of it counts.

use quietcut_numerics::statistics::binomial_interval;

/// Level of the binomial intervals: a correct claim is rejected with a probability of at most 0.001.
const LEVEL: f64 = 0.999;

/// Asserts that a counted share agrees with the `claimed` probability: the claim lies in the 99.9 % binomial interval
/// (Clopper–Pearson) of `hits` in `trials`.
///
/// The trials must be independent; for correlated ones, such as all parameters of one fit, see [`assert_pooled_share`].
///
/// # Panics
/// The claim lies outside of the interval.
#[track_caller]
pub fn assert_share(what: &str, claimed: f64, hits: usize, trials: usize) {
    let [low, high] = binomial_interval(LEVEL, hits, trials);
    assert!(
        (low..=high).contains(&claimed),
        "{what}: {hits} of {trials}; claimed {claimed}, 99.9 % interval {low:.3} to {high:.3}"
    );
}

/// Asserts that `share`, the mean of correlated shares, agrees with the `claimed` probability. The variance of this
/// mean is at most that of a share in `draws` independent trials, which is that of full correlation.
///
/// # Panics
/// The claim lies outside of the 99.9 % binomial interval of `share` in `draws` trials.
#[track_caller]
pub fn assert_pooled_share(what: &str, claimed: f64, share: f64, draws: usize) {
    assert_share(what, claimed, (share * draws as f64).round() as usize, draws);
}

/// Asserts that a counted share is not below the `least` claimed probability: the upper end of the 99.9 % binomial
/// interval of `hits` in `trials` reaches `least`.
///
/// # Panics
/// The interval lies below the claim.
#[track_caller]
pub fn assert_least_share(what: &str, least: f64, hits: usize, trials: usize) {
    let [low, high] = binomial_interval(LEVEL, hits, trials);
    assert!(
        high >= least,
        "{what}: {hits} of {trials}; claimed are at least {least}, 99.9 % interval {low:.3} to {high:.3}"
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 20 draws at 0.9, 12 or fewer have the probability 4.2e-4, less than half of 0.001, and 13 or fewer 2.4e-3.
    #[test]
    fn twelve_of_twenty_contradict_nine_of_ten() {
        assert_share("a claim", 0.9, 13, 20);
        assert_share("a claim", 0.9, 20, 20);
        assert_least_share("a claim", 0.5, 20, 20);
        assert!(std::panic::catch_unwind(|| assert_share("a claim", 0.9, 12, 20)).is_err());
        assert!(std::panic::catch_unwind(|| assert_least_share("a claim", 0.9, 12, 20)).is_err());
    }
}
