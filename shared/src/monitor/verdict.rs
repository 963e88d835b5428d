//! Computes the verdict and the advice after each block of samples.

use super::pipeline::Monitor;
use super::settings::Settings;
use super::state::{Advised, State};
use crate::advice::{self, Advice};
use crate::criteria::{
    ADVICE_FREQUENCY_STEP, ADVICE_SPEED_STEP, DAMAGE_MAX, SPEED_CHANGE_MAX, STALE_S, STALE_TOOTH_PERIODS,
};
use crate::detector::Judgement;
use crate::detector::evidence::Evidence;
use crate::detector::finding::Finding;
use crate::detector::growth::Growth;
use crate::lobes::LobeTable;
use crate::units::Rpm;
use crate::working_point::WorkingPoint;

impl Monitor {
    /// Passes the findings on growth, the spectra and the tones of both bands to the chatter detector. Returns its
    /// verdict.
    pub(super) fn judge(&self, state: &mut State, speed: Option<Rpm>, seconds: f32) -> Judgement {
        let change = state.tachometer.change_per_turn().unwrap_or(0.0);
        let sampled = self.tachometer.is_some();
        let teeth = f32::from(self.settings.tool.teeth);
        let tooth_period_s = speed.map_or(0.0, |speed| 1.0 / (speed.to_hertz().0 * teeth));
        let stale_s = (STALE_TOOTH_PERIODS * tooth_period_s).max(STALE_S);
        let finding = |growth: &Growth, since_passing_s: f32| -> Option<Finding> {
            let is_fresh = sampled && since_passing_s < stale_s;
            Some(*growth.finding()).filter(|finding| is_fresh && finding.passings > 0)
        };
        let (structure, tool) = (
            finding(&state.structure.growth, state.structure.since_passing_s),
            finding(&state.tool.growth, state.tool.since_passing_s),
        );
        let evidence = Evidence {
            speed: speed.map(Rpm::to_hertz),
            seconds,
            loudness: [state.structure.loudness.level(), state.tool.loudness.level()],
            changing: change.abs() > SPEED_CHANGE_MAX,
            damaged: state.damage > DAMAGE_MAX,
            teeth: self.settings.tool.teeth,
            findings: [structure.as_ref(), tool.as_ref()],
            new_passings: [state.structure.passed, state.tool.passed],
            floors: [state.structure.floor, state.tool.floor],
            spectra: [state.structure.spectrum(), state.tool.spectrum()],
            lines: [state.structure.lines.as_ref(), state.tool.lines.as_ref()],
            tones: [state.structure.tone.as_ref(), state.tool.tone.as_ref()],
            new_spectra: [state.structure.fresh, state.tool.fresh],
        };
        state.detector.step(&evidence)
    }

    /// Returns the previous advice, or computes new advice if an input has changed: speed and chatter frequency by more
    /// than [`ADVICE_SPEED_STEP`] and [`ADVICE_FREQUENCY_STEP`].
    pub(super) fn advise(
        &self,
        state: &mut State,
        judgement: &Judgement,
        speed: Rpm,
        table: Option<&LobeTable<'_>>,
        working_point: Option<&WorkingPoint>,
    ) -> Option<Advice> {
        let table_crc = table.and_then(|table| Some(table.header().ok()?.crc));
        let feed_direction = table.and_then(LobeTable::cut_direction);
        let moved = |a: f32, b: f32, step: f32| (a - b).abs() > step * b.abs();
        let same = state.advice.as_ref().filter(|advised| {
            let chatter = match (advised.chatter, judgement.chatter) {
                (Some(a), Some(b)) => !moved(a.0, b.0, ADVICE_FREQUENCY_STEP),
                (a, b) => a.is_none() && b.is_none(),
            };
            advised.verdict == judgement.verdict
                && chatter
                && !moved(advised.speed.0, speed.0, ADVICE_SPEED_STEP)
                && advised.working_point.as_ref() == working_point
                && advised.table == table_crc
                && advised.feed_direction == feed_direction
        });
        if let Some(advised) = same {
            return Some(advised.advice);
        }
        let Settings { limits, tool, .. } = &self.settings;
        let advice = advice::advise(judgement, speed, table, working_point, limits.as_ref(), tool);
        state.advice = Some(Advised {
            advice,
            verdict: judgement.verdict,
            chatter: judgement.chatter,
            speed,
            working_point: working_point.copied(),
            table: table_crc,
            feed_direction,
        });
        Some(advice)
    }
}
