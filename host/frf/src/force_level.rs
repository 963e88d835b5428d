//! Force level of a test.

use quietcut_numerics::statistics::median;

use super::criteria::SAME_FORCE;
use super::excitation::Excitation;
use super::hammer::force_peaks;
use super::test_channels::TestChannels;
use super::test_plausibility::is_cut;

/// Force level of a recording, N: with hammer excitation the median peak of the impacts (0 without an impact),
/// otherwise the root mean square of the force about its mean. For several forces, the root of the sum of the squares
/// of their levels.
pub(super) fn force_level(channels: &TestChannels<'_>, excitation: Excitation) -> f64 {
    let levels = channels.forces.iter().map(|(_, channel)| {
        let samples = &channel.samples;
        if excitation == Excitation::Hammer {
            return median(&mut force_peaks(samples, channels.recording.sample_rate_hz)).unwrap_or(0.0);
        }
        let count = samples.len().max(1) as f64;
        let mean = samples.iter().sum::<f64>() / count;
        (samples.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / count).sqrt()
    });
    levels.map(|level| level * level).sum::<f64>().sqrt()
}

/// Warning of averaged recordings of a shaker whose force levels differ by more than the factor [`SAME_FORCE`]. `None`
/// if they do not, for hammer and step-sine tests, and if any of the recordings is of a cut. The impacts of a hammer by
/// hand usually differ so much.
pub(super) fn averaged_levels(excitation: Excitation, members: &[TestChannels<'_>]) -> Option<String> {
    let is_shaker = matches!(
        excitation,
        Excitation::Random | Excitation::Sweep | Excitation::Multisine
    );
    if !is_shaker || members.iter().any(|member| is_cut(member.recording)) {
        return None;
    }
    let levels: Vec<f64> = members
        .iter()
        .map(|member| force_level(member, excitation))
        .collect();
    let least = levels.iter().copied().fold(f64::INFINITY, f64::min);
    let most = levels.iter().copied().fold(0.0, f64::max);
    (most > SAME_FORCE * least).then(|| {
        format!(
            "recordings at {least:.4} to {most:.4} N are averaged: the receptance of a nonlinear structure is another at each level; --by-level \
             states the peaks of each"
        )
    })
}
