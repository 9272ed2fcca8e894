//! How the cores are shared between decoding, remapping and the network: the one place that
//! decides.
//!
//! On a processor the network runs in as many sessions as there are cores, each on one thread and
//! on one view at a time: sessions need not wait for each other, while the threads of one session
//! do so at every layer, and a batch of views takes no less time than its views one by one.
//! Measured in benches/NOTES.md; `lookdown tune` measures it on the machine at hand.
//!
//! Counts come from what this process may use, not from what the machine has:
//! [`std::thread::available_parallelism`] knows the affinity mask and the CPU quota of the control
//! group, versions 1 and 2, rounded down. None of the threads spins while it has nothing to do, so
//! stages that take turns may each have all the cores.

use std::num::NonZeroUsize;

use crate::inference::Device;

/// One session uploads and renders while the other one computes.
const SESSIONS_ELSEWHERE: NonZeroUsize = NonZeroUsize::new(2).unwrap();
/// Views that a GPU or another server looks at in one run.
const BATCH_VIEWS_ELSEWHERE: NonZeroUsize = NonZeroUsize::new(8).unwrap();

/// Where networks compute.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Computing {
    /// On the cores of this process.
    Here,
    /// On a GPU or another server: the processor only hands over and takes back.
    Elsewhere,
}

impl Computing {
    pub(super) fn of(device: Device, is_remote: bool) -> Self {
        match device {
            Device::Cpu if !is_remote => Self::Here,
            _ => Self::Elsewhere,
        }
    }
}

/// How many threads each stage has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ThreadPlan {
    /// Frames worked on at once; each is decoded and merged on one thread. One more than there are
    /// cores, so that the network always finds the next frame ready.
    pub frame_workers: NonZeroUsize,
    /// Threads that build tables, and render batches of several views, for all frames together.
    pub remapping: NonZeroUsize,
    /// Sessions of each model, which run side by side.
    pub sessions: NonZeroUsize,
    /// Threads within one run of the network.
    pub per_session: NonZeroUsize,
}

impl ThreadPlan {
    /// The plan for this process, with what the operator wants, if anything.
    #[must_use]
    pub fn for_this_process(
        computing: Computing,
        sessions: Option<NonZeroUsize>,
        per_session: Option<NonZeroUsize>,
    ) -> Self {
        let cores = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        Self::of(cores, computing, sessions, per_session)
    }

    fn of(
        cores: NonZeroUsize,
        computing: Computing,
        sessions: Option<NonZeroUsize>,
        per_session: Option<NonZeroUsize>,
    ) -> Self {
        let share = |count: NonZeroUsize| {
            NonZeroUsize::new(cores.get() / count.get()).unwrap_or(NonZeroUsize::MIN)
        };
        let (sessions, per_session) = match computing {
            Computing::Here => (
                sessions.unwrap_or_else(|| per_session.map_or(cores, share)),
                per_session.unwrap_or_else(|| sessions.map_or(NonZeroUsize::MIN, share)),
            ),
            Computing::Elsewhere => (
                sessions.unwrap_or(SESSIONS_ELSEWHERE),
                per_session.unwrap_or(NonZeroUsize::MIN),
            ),
        };
        Self {
            frame_workers: cores.saturating_add(1),
            remapping: cores,
            sessions,
            per_session,
        }
    }
}

/// Most views in one run of the network, where the operator leaves the choice.
pub(super) fn batch_views(computing: Computing) -> NonZeroUsize {
    match computing {
        Computing::Here => NonZeroUsize::MIN,
        Computing::Elsewhere => BATCH_VIEWS_ELSEWHERE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sessions, and threads in each, on eight cores.
    fn plan(
        device: Device,
        is_remote: bool,
        sessions: usize,
        per_session: usize,
    ) -> (usize, usize) {
        let (cores, wanted) = (NonZeroUsize::new(8).unwrap(), NonZeroUsize::new);
        let computing = Computing::of(device, is_remote);
        let plan = ThreadPlan::of(cores, computing, wanted(sessions), wanted(per_session));
        (plan.sessions.get(), plan.per_session.get())
    }

    #[test]
    fn each_core_has_a_session_of_its_own_unless_somebody_says_otherwise() {
        assert_eq!(plan(Device::Cpu, false, 0, 0), (8, 1));
        assert_eq!(plan(Device::Cpu, false, 2, 0), (2, 4));
        assert_eq!(plan(Device::Cpu, false, 0, 3), (2, 3));
        assert_eq!(plan(Device::Cpu, false, 5, 4), (5, 4));
        assert_eq!(plan(Device::Cpu, false, 16, 0), (16, 1));
    }

    #[test]
    fn a_gpu_and_another_server_take_turns_in_two_sessions() {
        assert_eq!(plan(Device::Cuda(0), false, 0, 0), (2, 1));
        assert_eq!(plan(Device::TensorRt(0), false, 1, 2), (1, 2));
        assert_eq!(plan(Device::Cpu, true, 0, 0), (2, 1));
        assert_eq!(batch_views(Computing::Elsewhere).get(), 8);
    }

    #[test]
    fn one_core_is_enough() {
        let plan = ThreadPlan::of(NonZeroUsize::MIN, Computing::Here, None, None);
        assert_eq!((plan.sessions.get(), plan.per_session.get()), (1, 1));
        assert_eq!((plan.remapping.get(), plan.frame_workers.get()), (1, 2));
    }
}
