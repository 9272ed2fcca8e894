//! The thread plan: the shares of decoding, remapping and inference in the cores. No other module
//! decides them.
//!
//! On a CPU there are as many sessions as cores, each with one thread and one view at a time.
//! Sessions do not wait for each other, while the threads of one session synchronize at every
//! layer. A batch of views takes as long as its views one by one. Measured in lab/benches/NOTES.md.
//!
//! The counts follow from the cores that this process may use:
//! [`std::thread::available_parallelism`] respects the affinity mask and the CPU quota of the
//! control group (versions 1 and 2), rounded down. Idle threads do not spin, so stages that
//! alternate may each use all cores.

use std::num::NonZeroUsize;

use lookdown_detect::inference::Device;

use super::{declare::settings, form::count};

/// Two sessions: one uploads and renders while the other one computes.
const SESSIONS_ELSEWHERE: NonZeroUsize = NonZeroUsize::new(2).unwrap();
/// Views in one run on a GPU or another server.
const BATCH_VIEWS_ELSEWHERE: NonZeroUsize = NonZeroUsize::new(8).unwrap();

settings! {
    /// The use of the cores as it is written.
    #[derive(Debug, Clone)]
    pub(super) struct ThreadKeys in "inference" {
        /// The sessions of each model, which run side by side. 0: on a CPU one for each core that
        /// the machine or the container's CPU limit gives, on another device or server two.
        sessions: Option<NonZeroUsize> = None => count();
        /// The threads of each session. 0: one; where `inference.sessions` is set, their share of
        /// the cores.
        threads: Option<NonZeroUsize> = None => count();
        /// The most views in one run of the network, of one or several frames. 0: one on a CPU,
        /// where more is not faster, eight on another device or server. On another device every
        /// run has as many: black views take the place of missing ones.
        max_batch_views: Option<NonZeroUsize> = None => count();
    }
}

impl ThreadKeys {
    /// The plan for this process.
    pub(super) fn plan(&self, device: Device, is_remote: bool) -> ThreadPlan {
        let cores = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        ThreadPlan::new(cores, Computing::new(device, is_remote), self)
    }
}

/// The processor that runs the models.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Computing {
    /// The cores of this process.
    Here,
    /// A GPU or another server: the CPU only sends views and receives boxes.
    Elsewhere,
}

impl Computing {
    fn new(device: Device, is_remote: bool) -> Self {
        if device.is_processor() && !is_remote {
            Self::Here
        } else {
            Self::Elsewhere
        }
    }
}

/// The numbers of threads of each stage, and of views in a batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ThreadPlan {
    /// Frames processed at once; each is decoded and merged on one thread. One more than there are
    /// cores, so that inference always has a next frame.
    pub frame_workers: NonZeroUsize,
    /// Threads that build tables, and render batches of several views, for all frames together.
    pub remapping: NonZeroUsize,
    /// Sessions of each model, which run in parallel.
    pub sessions: NonZeroUsize,
    /// Threads of each session.
    pub per_session: NonZeroUsize,
    /// Largest number of views in one batch.
    pub batch_views: NonZeroUsize,
}

impl ThreadPlan {
    fn new(cores: NonZeroUsize, computing: Computing, keys: &ThreadKeys) -> Self {
        let share = |count: NonZeroUsize| {
            NonZeroUsize::new(cores.get() / count.get()).unwrap_or(NonZeroUsize::MIN)
        };
        let (sessions, per_session) = (keys.sessions, keys.threads);
        let (sessions, per_session, batch_views) = match computing {
            Computing::Here => (
                sessions.unwrap_or_else(|| per_session.map_or(cores, share)),
                per_session.unwrap_or_else(|| sessions.map_or(NonZeroUsize::MIN, share)),
                NonZeroUsize::MIN,
            ),
            Computing::Elsewhere => (
                sessions.unwrap_or(SESSIONS_ELSEWHERE),
                per_session.unwrap_or(NonZeroUsize::MIN),
                BATCH_VIEWS_ELSEWHERE,
            ),
        };
        Self {
            frame_workers: cores.saturating_add(1),
            remapping: cores,
            sessions,
            per_session,
            batch_views: keys.max_batch_views.unwrap_or(batch_views),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sessions, and threads in each, on eight cores.
    fn plan(device: Device, is_remote: bool, sessions: usize, threads: usize) -> (usize, usize) {
        let keys = ThreadKeys {
            sessions: NonZeroUsize::new(sessions),
            threads: NonZeroUsize::new(threads),
            ..ThreadKeys::default()
        };
        let computing = Computing::new(device, is_remote);
        let plan = ThreadPlan::new(NonZeroUsize::new(8).unwrap(), computing, &keys);
        (plan.sessions.get(), plan.per_session.get())
    }

    #[test]
    fn each_core_has_a_session_of_its_own_by_default() {
        assert_eq!(plan(Device::Cpu, false, 0, 0), (8, 1));
        assert_eq!(plan(Device::Cpu, false, 2, 0), (2, 4));
        assert_eq!(plan(Device::Cpu, false, 0, 3), (2, 3));
        assert_eq!(plan(Device::Cpu, false, 5, 4), (5, 4));
        assert_eq!(plan(Device::Cpu, false, 16, 0), (16, 1));
    }

    #[test]
    fn a_gpu_and_another_server_use_two_sessions() {
        assert_eq!(plan(Device::Cuda(0), false, 0, 0), (2, 1));
        assert_eq!(plan(Device::TensorRt(0), false, 1, 2), (1, 2));
        assert_eq!(plan(Device::Cpu, true, 0, 0), (2, 1));
        let eight_cores = NonZeroUsize::new(8).unwrap();
        let plan = ThreadPlan::new(eight_cores, Computing::Elsewhere, &ThreadKeys::default());
        assert_eq!(plan.batch_views.get(), 8);
    }

    #[test]
    fn one_core_is_enough() {
        let plan = ThreadPlan::new(NonZeroUsize::MIN, Computing::Here, &ThreadKeys::default());
        assert_eq!((plan.sessions.get(), plan.per_session.get()), (1, 1));
        assert_eq!((plan.remapping.get(), plan.frame_workers.get()), (1, 2));
    }
}
