//! A branch up to its last recorded orbit.

use super::branch::Branch;
use super::branch_record::BranchRecord;
use super::follower::{Follower, Sample};
use super::periodic_orbit::{PeriodMap, Predecessor};
use crate::criteria::BRANCH_STEP_MAX;

impl<M: PeriodMap> Follower<M> {
    /// Appends recorded orbits to a branch that has only its first orbit. Returns the last orbit and the length of the
    /// next step; `None` if the records are none of this branch.
    pub(super) fn resumed(
        &self,
        branch: &mut Branch,
        first: Sample,
        records: &[BranchRecord],
    ) -> Option<(Sample, f64)> {
        let order = self.map.problem().order();
        let mut here = first;
        for record in records {
            let (orbit, tangent) = record.restored(order, &here.orbit)?;
            let before = Predecessor {
                orbit: here.orbit,
                tangent: here.tangent,
                step: record.step,
            };
            here = Sample {
                orbit,
                tangent,
                before: Some(before),
                roots: Vec::new(),
                largest: 0.0,
            };
            branch.points.push(record.point.clone());
            branch.events.extend(record.restored_events(order)?);
        }
        match records.last() {
            None => Some((here, BRANCH_STEP_MAX)),
            Some(last) => {
                let before = here.before.take();
                let mut sample = self.with_multipliers(here.orbit, here.tangent).ok()?;
                sample.before = before;
                Some((sample, last.next_step))
            }
        }
    }
}
