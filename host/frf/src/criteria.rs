//! Thresholds by which this crate decides, each with the source of its number.
//!
//! A number without a derivation or a campaign behind it is marked "Unfounded" or "a choice". Window lengths, numbers
//! of segments and bounds of iterations decide nothing about a recording and stay beside the code that uses them.

// Hammer tests

/// Longest time from the start of an impact to the start of a bounce of the hammer, s: a pulse that starts later is an
/// impact of its own. Bounces follow within some 0.1 s, deliberate strikes after a second or more; the value between is
/// unfounded.
pub(crate) const BOUNCE_S: f64 = 0.4;

/// Smallest peak force of an impact of a hammer, as a fraction of the largest force of the recording; both are
/// magnitudes of the deviation from the median force. Impacts by hand differ by less than a factor of ten. Unfounded.
pub(crate) const LEAST_IMPACT: f64 = 0.1;

/// Smallest peak of a force pulse that counts as an impact of a hammer, or as its second pulse, in standard deviations
/// of the force noise. Gaussian noise exceeds it with a probability of 1.2e-15 per sample: about once in 10⁸ recordings
/// of 10⁷ samples.
pub(crate) const PULSE_ABOVE_NOISE: f64 = 8.0;

/// Force at which a hammer pulse begins and ends, as a fraction of the smallest peak force of an impact. That peak
/// force is the larger one of [`LEAST_IMPACT`] and [`PULSE_ABOVE_NOISE`], both in N. Unfounded.
pub(crate) const PULSE_END: f64 = 0.05;

/// Smallest force at which a hammer pulse begins and ends, in standard deviations of the force noise; it replaces the
/// force of [`PULSE_END`] if it is larger. Gaussian noise stays within two standard deviations in 95 % of the samples,
/// so that it hardly lengthens a pulse.
pub(crate) const PULSE_END_ABOVE_NOISE: f64 = 2.0;

/// Smallest second force pulse of a hammer that makes an impact a double impact, as a fraction of the first peak; the
/// pulse must also exceed [`PULSE_ABOVE_NOISE`]. The force window removes the second pulse but not the response to
/// it, so that a smaller pulse causes an error of the FRF of up to this fraction. That 3 % are tolerable is unfounded.
pub(crate) const SECOND_PULSE: f64 = 0.03;

/// Largest contribution of an exponential window to the measured decay rate of a mode, as a fraction of that rate. The
/// measured rate less this contribution is the decay rate of the mode itself. At the limit the relative error of the
/// latter is twenty times that of the measured rate: 20 % where the measured rate is known to 1 %. Unfounded.
pub(crate) const LARGEST_WINDOW_SHARE: f64 = 0.95;

/// Smallest number of single impacts of a hammer test with which coherence and standard deviation are stated; with
/// fewer, there is a warning instead. The expected coherence of unrelated signals is 1/n with n averages: 1 with one
/// impact, 1/2 with two. That three suffice is unfounded.
pub(crate) const IMPACTS_MIN: usize = 3;

/// Largest amplitude of a windowed hammer response at the end of its segment, as a fraction of the peak of the response
/// in the segment; a larger one causes a warning. Truncation of an exponential decay at the fraction a lowers the
/// resonance peak by the fraction a. That 2 % are tolerable is unfounded.
pub(crate) const END_AMPLITUDE: f64 = 0.02;

// Independence of forces

/// Smallest singular value of the force spectra with which several simultaneous forces are linearly independent at a
/// frequency line, scaled as in `FrfLine::singular`. Below it, noise of 1 % of a force causes errors as large as the
/// FRF.
pub(crate) const DEPENDENT: f64 = 1e-2;

/// Smallest excess of the number of independent averages of the spectra over the number of forces; with less, an FRF
/// measurement with random or swept excitation is refused. With as many averages as forces, the coherence is 1 whatever
/// the noise. The half average is unfounded.
pub(crate) const SPARE_AVERAGES: f64 = 0.5;

/// Smallest force power of a frequency line that lies within the swept range of a swept sine, or that a periodic force
/// excites, as a fraction of the largest force power of all evaluated lines. At resonances the force of a shaker drops
/// to about 1e-2 of the largest power; the tenth of that is unfounded.
pub(crate) const EXCITED: f64 = 1e-3;

// Step-sine tests

/// Smallest number of excitation periods in one frequency step of a step-sine test: the median absolute deviation of
/// the periods needs several. Unfounded.
pub(crate) const PERIODS_MIN: usize = 8;

/// Smallest relative change of the excitation period that begins a new frequency step of a step-sine test, and smallest
/// relative difference of the frequencies of two steps with which they are no repetitions. Usual increments between
/// steps near a resonance are four times as large. Unfounded.
pub(crate) const FREQUENCY_STEP: f64 = 1.5e-3;

/// Smallest deviation of an excitation period from the mean period of its frequency step that begins a new step, in
/// robust standard deviations of the first [`PERIODS_MIN`] periods of the step; the deviation must also exceed
/// [`FREQUENCY_STEP`]. Two periods in a row must deviate so far, or the mean of the last [`PERIODS_MIN`] periods must
/// drift. A Gaussian deviation exceeds it about once in 2 million periods.
pub(crate) const PERIOD_SCATTER: f64 = 5.0;

/// Largest robust standard deviation of the first [`PERIODS_MIN`] excitation periods of a frequency step, relative to
/// their mean, as a multiple of [`FREQUENCY_STEP`]. With a larger one the frequency of the sine counts as changing, and
/// no step begins. Unfounded.
pub(crate) const STEADY_SCATTER: f64 = 10.0;

/// Smallest deviation of an excitation period from the mean period of its frequency step that marks a pause of the
/// sine, as a fraction of that mean. A pause of one period or more without a zero crossing at least doubles the period,
/// noise changes it by some percent. The half is unfounded.
pub(crate) const PAUSE: f64 = 0.5;

/// Smallest number of subsegments into which a frequency step of a step-sine test is divided: two for the steady state
/// and two for the transient before. Unfounded.
pub(crate) const SUBSEGMENTS_MIN: usize = 4;

/// Smallest number of samples in a subsegment of a frequency step. The fit of cosine, sine, offset and drift to the
/// subsegment has four unknowns; the estimate of the noise needs one sample more.
pub(crate) const SUBSEGMENT_SAMPLES_MIN: usize = 5;

/// Largest deviation of the phasor ratio response/force of a subsegment from the mean of this ratio over the second
/// half of the frequency step with which the response counts as settled, as a fraction of that mean. The response may
/// also differ by noise, see [`SETTLED_NOISE`]. The same fraction holds for the response spectrum of a period of
/// periodic excitation. Unfounded.
pub(crate) const SETTLED: f64 = 2e-3;

/// Largest deviation of the phasor ratio response/force of a subsegment from the mean of this ratio over the second
/// half of the frequency step that noise explains in a settled response, in standard deviations of the ratio of the
/// subsegment. If the error of a ratio is complex and Gaussian, 1 of 8000 subsegments exceeds three deviations, e⁻⁹.
pub(crate) const SETTLED_NOISE: f64 = 3.0;

/// Largest ratio of the median force amplitudes of two passes through the frequency range of a step-sine test that
/// count as one force level. The amplitude of a controlled shaker varies by some percent. Unfounded.
pub(crate) const SAME_LEVEL: f64 = 1.05;

/// Largest ratio of two force levels that count as equal: the level that the user selects and the evaluated level of a
/// step-sine test; two recordings whose receptances are measured together at one level; and, without a warning, the
/// force amplitudes of the frequency steps of a level and the levels of averaged shaker recordings. Unfounded.
pub(crate) const SAME_FORCE: f64 = 1.2;

/// Probability with which the peak of a linear structure at several force levels stays below the χ² from which its
/// frequency, and likewise its damping, count as dependent on the level.
pub(crate) const HOMOGENEOUS_PROBABILITY: f64 = 0.99;

/// Smallest length of a repeated frequency step with which it replaces an earlier step of about the same frequency, as a
/// fraction of the length of the longest of these steps. Unfounded.
pub(crate) const REPEATED_STEP: f64 = 0.9;

// Noise plateau of a spectrum

/// Number of adjacent frequency bands of equal width into which a spectrum is divided (up to one more or fewer by
/// rounding); their mean powers are compared to find the noise plateau. Unfounded.
pub(crate) const BANDS: usize = 64;

/// Smallest number of frequency bands with about equal mean power, see [`PLATEAU_RANGE`], that form the noise plateau
/// of a spectrum. Unfounded.
pub(crate) const PLATEAU_BANDS: usize = 3;

/// Smallest number of frequency lines in each band of the search for the noise plateau of a spectrum. The relative
/// standard deviation of the mean power of white noise in a band, 1/√50, is then 14 %. Unfounded.
pub(crate) const LINES_PER_BAND_MIN: usize = 50;

/// Largest excess of the mean power of a frequency band in the noise plateau over the mean power of the lowest band, in
/// standard deviations of the latter. The range of 64 normal variables is 4.8 on average and rarely above 6; a plateau
/// without its highest bands has nearly the same median.
pub(crate) const PLATEAU_RANGE: f64 = 6.0;

// Tool-tip calibration

/// Smallest relative decrease of the RMS residual by which a vector fit with more modes replaces the best one before. A
/// mode that fits only noise decreases the residual by some percent: by half the number of added unknowns per equation.
/// Unfounded.
pub(crate) const RESIDUAL_DECREASE: f64 = 0.3;

/// RMS residual of a vector fit, relative to the fitted receptances, below which no further mode is added. It is near
/// the noise of a good measurement. Unfounded.
pub(crate) const SMALL_RESIDUAL: f64 = 2e-3;

/// Largest shift |ln(f₁/f₂)| between the natural frequency f₁ of a mode in the tool-tip calibration and f₂ in the
/// measurement to which the calibration is applied, with which both count as the same mode. Unfounded.
pub(crate) const SAME_MODE: f64 = 0.15;

/// Smallest resonance peak of a fitted mode in a receptance, as a fraction of the largest peak of all fitted modes in
/// that receptance. A pole with a lower peak in every receptance counts as noise. Unfounded.
pub(crate) const LEAST_PEAK: f64 = 2e-3;

/// Largest damping ratio with which a pole of a vector fit counts as a mode. The peak of a pole with more damping
/// hardly stands out: the half-power bandwidth is more than half the frequency. Unfounded.
pub(crate) const LARGEST_DAMPING_RATIO: f64 = 0.3;

// Plausibility of a test

/// Largest share of the samples of a record that lie in force pulses, if the force is that of a hammer. A tooth of a
/// milling cutter cuts over more of its revolution than 7°, which is this share. A choice.
pub(crate) const STRUCK_SHARE: f64 = 0.02;

/// Smallest share of the energy of a force that lies in its pulses, if the force is that of a hammer. Between impacts
/// there is only the noise of the sensor; a random force has nearly all of its energy outside of such pulses. A choice.
pub(crate) const STRUCK_ENERGY: f64 = 0.9;

/// Ratio of the effective number of samples of the force to that of the response above which the two may be swapped. In
/// a test with a hammer the response rings longer than the force acts, which is a ratio below 1. The distance from 1 is
/// a choice.
pub(crate) const PULSE_SHORTER: f64 = 3.0;

/// Smallest share, in the energy of the samples above a fifth of a hammer's peak, of the samples with the sign of the
/// peak: a hammer pushes and does not pull. Filters ring by some percent, a choice.
pub(crate) const ONE_SIGN: f64 = 0.95;

/// Ratio of the mean power of a signal just after a pulse of another channel to that just before the pulse, above which
/// the signal counts as ringing because of the pulse. Without a cause the ratio is about 1; a choice.
pub(crate) const RINGS_AFTER: f64 = 3.0;

/// Share of the energy of a channel in one sine within 0.2 Hz of 50 or 60 Hz above which the hum of the mains is larger
/// than all the rest of the channel: one half.
pub(crate) const HUM_SHARE: f64 = 0.5;

/// Smallest ratio of a spike of one sample to the next largest sample, both as distances from the median. The largest
/// of 10⁷ Gaussian samples is nearly always within a factor of 2 of the next largest; a choice above.
pub(crate) const SPIKE_ABOVE: f64 = 3.0;

/// Largest neighbour of a spike of one sample, as a fraction of the spike, both as distances from the median. The
/// largest sample of a pulse that lasts several samples has larger neighbours. A choice.
pub(crate) const SPIKE_NEIGHBOURS: f64 = 0.05;

/// Largest share of the segments or periods of a record that may be clipped if the others are evaluated. With more than
/// one half the median part is clipped: those that remain are the weakest, and their level is not that of the test.
pub(crate) const CLIPPED_PARTS: f64 = 0.5;

/// Coherence below which noise has more energy than the response to the force: γ² = S/(S + N) with S = N.
pub(crate) const UNRELATED: f64 = 0.5;

/// Coherence at the peak of a receptance below which the whole response counts as unrelated to the force, if the median
/// of the coherence over the lines is below [`UNRELATED`]. With five averages the coherence of unrelated signals
/// exceeds it with a probability of 0.2⁴ per line.
pub(crate) const UNRELATED_PEAK: f64 = 0.8;

/// Mean of the sine of the phase of a drive-point receptance, weighted with |ωH|², above which the sign of the
/// receptance counts as that of an inverted sensor. The sine of a passive drive point is never above 0; it is about −1
/// at a resonance. A choice.
pub(crate) const INVERTED_PHASE: f64 = 0.2;

/// Lowest and highest plausible peak of a receptance, m/N. The most compliant structures that are tapped, thin walls,
/// reach 10⁻³ at resonance; the stiffest have 10⁻¹⁰ statically. A decade more on the soft side, two on the stiff; a
/// choice.
pub(crate) const PLAUSIBLE_RECEPTANCE: [f64; 2] = [1e-12, 1e-2];

/// Range of plausible forces of the hardest impact of a hammer test, N. The smallest instrumented hammers have a range of
/// 200 N and resolve some mN, the largest sledges a range of 22 kN. Below a thousandth of the former, and above twice the
/// latter, a unit is taken for wrong; a choice.
pub(crate) const PLAUSIBLE_IMPACT_N: [f64; 2] = [0.2, 4.5e4];

/// Smallest ratio of the power of a frequency line of a periodic force to the median power of the lines around it. The
/// largest of 64 independent exponential powers of a random force exceeds 50 medians with a probability of 64·2⁻⁵⁰.
pub(crate) const LINE_ABOVE_NEIGHBOURS: f64 = 50.0;

/// Smallest share of the energy of a force in single lines, or repeated after a period, with which the force counts as
/// periodic. A random force has hardly any, the force of a steady cut all but its noise. A choice.
pub(crate) const SHARE_OF_LINES: f64 = 0.9;

// Periodic excitation

/// Smallest number of whole periods in a record of periodic excitation: two that may hold the transient, and two whose
/// difference is the noise that the transient is compared with.
pub(crate) const PERIODS_RECORDED_MIN: usize = 4;

/// Largest distance of the highest strong line of a periodic force from its line of the transform, in line spacings,
/// with which the period counts as a whole number of samples. About this fraction of a line leaks into its neighbours,
/// which is the relative error of the FRF.
pub(crate) const PERIOD_SHIFT: f64 = 1e-3;

/// Smallest number of standard deviations by which the period of a force that is refused differs from a whole number of
/// samples; the difference must also exceed [`PERIOD_SHIFT`]. Gaussian noise reaches it in one of 16 000 records.
pub(crate) const PERIOD_SHIFT_ERRORS: f64 = 4.0;

/// Smallest number of excited lines in the evaluated band with which a periodic force is taken for a multisine without
/// being told. A sine has one, the force of a cut in a band of some tooth-passing frequencies a few. Unfounded.
pub(crate) const MULTISINE_LINES_MIN: usize = 10;

/// Energy of the difference between two consecutive periods of a force, as a multiple of its median over all pairs,
/// above which the force changes there, as at its start and its end. The ratio of the noise energies of two periods of
/// a hundred samples exceeds 2 in three of 1e4. Unfounded above that.
pub(crate) const FORCE_CHANGE: f64 = 10.0;

/// Smallest power of an excited line of a periodic force, as a multiple of the variance of its mean over the periods.
/// With many periods, noise alone exceeds it with the probability e⁻¹⁶ per line.
pub(crate) const LINE_ABOVE_NOISE: f64 = 16.0;

/// Probability with which noise alone is taken for a transient or a nonlinear distortion: once in a thousand tests. A
/// choice.
pub(crate) const FALSE_ALARM: f64 = 1e-3;

/// Smallest distortion that counts as significant, relative to the response. Rounding in a file of five digits is as
/// large.
pub(crate) const LEAST_DISTORTION: f64 = 1e-5;

/// Largest correlation, over all shifts in time, of the spectra of two periodic forces that count as having different
/// phases. The correlation of n lines of random phases exceeds c at one of the n independent shifts with the
/// probability n·exp(−n c²): 1e-3 with 10 lines, 5e-11 with 30.
pub(crate) const SAME_PHASES: f64 = 0.95;

// Mass of the accelerometer

/// Smallest number of lines between the half-power points of a peak from which its modal mass is estimated: one more
/// than the two unknowns of a straight line.
pub(crate) const PEAK_LINES_MIN: usize = 3;

/// Mass of an accelerometer that is assumed for its effect if none is given, kg. Sensors for taps of tools weigh 0.5 to
/// 10 g; a choice between.
pub(crate) const ASSUMED_ACCELEROMETER_KG: f64 = 5e-3;

/// Smallest relative shift of a peak by an accelerometer that is warned of. Charts resolve the speed to 0.1 %, and
/// lobes move with the frequency.
pub(crate) const LEAST_PEAK_SHIFT: f64 = 1e-3;

// Peaks of a receptance

/// Smallest peak that is fitted in a comparison, as a fraction of the largest |H| of the receptance. The depth limit
/// from a peak is inversely proportional to the peak: lower peaks limit at more than ten times the depth.
pub(crate) const LEAST_COMPARED_PEAK: f64 = 0.1;

/// Number of standard deviations that the damping ratio and the size of a fitted peak must each exceed. A Gaussian
/// error exceeds it with a probability of 3e-5.
pub(crate) const PEAK_ABOVE_NOISE: f64 = 4.0;

/// Smallest |H| of the lines of a fit of one peak, as a fraction of the peak, unless these are fewer than
/// [`FITTED_LINES_MIN`]. At one half the contribution of other modes is still nearly a straight line over the band, 1.7
/// half-power bandwidths. Unfounded.
pub(crate) const FITTED_PART: f64 = 0.5;

/// Smallest number of lines of a fit of one peak: its four complex unknowns, and as many for the scatter.
pub(crate) const FITTED_LINES_MIN: usize = 8;
