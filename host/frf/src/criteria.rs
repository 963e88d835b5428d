//! Every threshold by which this crate decides, each with the source of its number.
//!
//! A number without a derivation or a campaign behind it is marked "Unfounded". Window lengths, numbers of segments and bounds of iterations
//! decide nothing about a recording and stay beside the code that uses them.

// Hammer tests

/// Longest time from an impact to a bounce of the hammer, s: a later pulse is an impact of its own. Bounces follow within some 0.1 s,
/// deliberate strikes after a second or more; the value between is unfounded.
pub(crate) const BOUNCE_S: f64 = 0.4;

/// Smallest peak of an impact, as a fraction of the largest force of the recording. Impacts by hand differ by less than a factor of ten.
/// Unfounded.
pub(crate) const LEAST_IMPACT: f64 = 0.1;

/// Smallest peak of a force pulse, in standard deviations of the force noise. Gaussian noise exceeds it with a probability of 1.2e-15 per
/// sample: once in 10⁸ recordings of 10⁷ samples.
pub(crate) const PULSE_ABOVE_NOISE: f64 = 8.0;

/// Force at the two ends of a pulse, as a fraction of the force above which a pulse counts as an impact, the larger of [`LEAST_IMPACT`] and
/// [`PULSE_ABOVE_NOISE`]. Unfounded.
pub(crate) const PULSE_END: f64 = 0.05;

/// Force at the two ends of a pulse, in standard deviations of the force noise, if that is larger than [`PULSE_END`]. Gaussian noise stays
/// below two standard deviations in 95 % of the samples, so that it hardly lengthens a pulse.
pub(crate) const PULSE_END_ABOVE_NOISE: f64 = 2.0;

/// Smallest second pulse that makes an impact double, as a fraction of the first peak. The force window removes the second pulse but not its
/// response, so that a smaller one causes an error of the FRF of up to this fraction. That 3 % are tolerable is unfounded.
pub(crate) const SECOND_PULSE: f64 = 0.03;

/// Largest share of an exponential window in the decay rate of a mode with which the rest is taken as the mode's own. The
/// relative error of the damping then is twenty times that of the measured decay rate: 20 % where that is known to 1 %. Unfounded.
pub(crate) const LARGEST_WINDOW_SHARE: f64 = 0.95;

/// Smallest number of single impacts without a warning. The expected coherence of unrelated signals is 1/n with n averages: 1 with one impact,
/// 1/2 with two. That three suffice is unfounded.
pub(crate) const IMPACTS_MIN: usize = 3;

/// Largest amplitude of a response at the end of a segment without a warning, as a fraction of its peak. Truncation of an exponential decay at
/// the fraction a lowers the resonance peak by the fraction a. That 2 % are tolerable is unfounded.
pub(crate) const END_AMPLITUDE: f64 = 0.02;

// Independence of forces

/// Smallest singular value of the force spectra, each force divided by its root mean square, for independent forces. Below it, noise of 1 % of
/// a force causes errors as large as the FRF.
pub(crate) const DEPENDENT: f64 = 1e-2;

/// Smallest number of independent averages beyond the number of forces. With as many averages as forces, the coherence is 1 whatever the
/// noise. The half average is unfounded.
pub(crate) const SPARE_AVERAGES: f64 = 0.5;

/// Smallest force power of a frequency line within the range of a sweep, as a fraction of the largest. At resonances the force of a shaker
/// drops to about 1e-2 of the largest power; the tenth of that is unfounded.
pub(crate) const EXCITED: f64 = 1e-3;

// Step-sine tests

/// Smallest number of periods of a frequency step: the median absolute deviation of the periods needs several. Unfounded.
pub(crate) const PERIODS_MIN: usize = 8;

/// Smallest relative change of the period that begins a new frequency step. Usual increments within a resonance are four times as large.
/// Unfounded.
pub(crate) const FREQUENCY_STEP: f64 = 1.5e-3;

/// Deviation of a period from the mean of its step that begins a new step, in standard deviations of the periods. Two periods in a row must
/// deviate so far; a Gaussian deviation exceeds it once in 2 million periods.
pub(crate) const PERIOD_SCATTER: f64 = 5.0;

/// Largest standard deviation of the periods of a step, as a multiple of [`FREQUENCY_STEP`]; a larger one is a change of frequency. Unfounded.
pub(crate) const STEADY_SCATTER: f64 = 10.0;

/// Smallest deviation of a period from the mean of its step, relative, that is a pause. A pause without a zero crossing at least doubles the
/// period, noise changes it by some percent. The half is unfounded.
pub(crate) const PAUSE: f64 = 0.5;

/// Smallest number of subsegments of a frequency step: two for the steady state and two for the transient before. Unfounded.
pub(crate) const SUBSEGMENTS_MIN: usize = 4;

/// Smallest number of samples of a subsegment. A fit of cosine, sine, offset and drift has four unknowns; the noise needs one sample more.
pub(crate) const SUBSEGMENT_SAMPLES_MIN: usize = 5;

/// Largest relative deviation of the phasor ratio (response/force) of a settled response from its mean over the second half. Unfounded.
pub(crate) const SETTLED: f64 = 2e-3;

/// Largest deviation of a settled phasor ratio that noise explains, in standard deviations. The error of a phasor is complex and Gaussian: 1 of
/// 8000 subsegments exceeds three deviations, e⁻⁹.
pub(crate) const SETTLED_NOISE: f64 = 3.0;

/// Largest ratio of forces that count as one force level of a recording. The amplitude of a controlled shaker varies by some percent.
/// Unfounded.
pub(crate) const SAME_LEVEL: f64 = 1.05;

/// Largest ratio of forces that count as one level where the user selects a level, and without a warning of a varying force. Unfounded.
pub(crate) const SAME_FORCE: f64 = 1.2;

/// Smallest length of a repeated frequency step, relative to the longest at this frequency, that replaces it as the newer one. Unfounded.
pub(crate) const REPEATED_STEP: f64 = 0.9;

// Noise plateau of a spectrum

/// Number of adjacent bands of a spectrum whose mean powers are compared to find the noise plateau. Unfounded.
pub(crate) const BANDS: usize = 64;

/// Smallest number of bands with equal power that form a noise plateau. Unfounded.
pub(crate) const PLATEAU_BANDS: usize = 3;

/// Smallest number of frequency lines per band. The standard deviation of the mean power of a band, 1/√50, is then 14 %. Unfounded.
pub(crate) const LINES_PER_BAND_MIN: usize = 50;

/// Largest distance of the power of a band of the plateau above the lowest band, in standard deviations. The range of 64 normal variables is 4.8
/// on average and rarely above 6; without its highest bands a plateau keeps its median.
pub(crate) const PLATEAU_RANGE: f64 = 6.0;

// Tool-tip calibration

/// Smallest relative decrease of the residual by which a further mode is accepted. A mode that fits only noise decreases it by some percent, half
/// its share of the unknowns. Unfounded.
pub(crate) const RESIDUAL_DECREASE: f64 = 0.3;

/// Relative residual below which no further mode is added, near the noise of a good measurement. Unfounded.
pub(crate) const SMALL_RESIDUAL: f64 = 2e-3;

/// Largest shift of a natural frequency between calibration and cut, |ln(f₁/f₂)|. Unfounded.
pub(crate) const SAME_MODE: f64 = 0.15;

/// Smallest peak of a mode, as a fraction of the largest peak of a function; a pole with a lower peak is noise. Unfounded.
pub(crate) const LEAST_PEAK: f64 = 2e-3;

/// Largest damping ratio of a mode. A pole with more damping has no peak that stands out of its neighbours: its half-power bandwidth is more
/// than half its frequency. Unfounded.
pub(crate) const LARGEST_DAMPING_RATIO: f64 = 0.3;
