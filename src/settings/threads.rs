//! How the cores are shared between decoding, remapping and the network: the one place that
//! decides.
//!
//! Counts come from what this process may use, not from what the machine has:
//! [`std::thread::available_parallelism`] knows the affinity mask and the CPU quota of the control
//! group, versions 1 and 2, rounded down. None of the threads spins while it has nothing to do, so
//! stages that take turns may each have all the cores.

use std::num::NonZeroUsize;

use crate::inference::Device;

/// Frames worked on at once: the next one is decoded and rendered while the network works on the
/// current one. The network takes one frame at a time, so more would only wait.
const FRAME_WORKERS: NonZeroUsize = NonZeroUsize::new(2).unwrap();

/// How many threads each stage has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ThreadPlan {
    /// Frames worked on at once; each is decoded and merged on one thread.
    pub frame_workers: NonZeroUsize,
    /// Threads that render views, for all frames together.
    pub remapping: NonZeroUsize,
    /// Threads within one run of the network.
    pub network: NonZeroUsize,
}

impl ThreadPlan {
    /// The plan for this process. `network` is what the operator wants, if anything.
    #[must_use]
    pub fn for_this_process(device: Device, network: Option<NonZeroUsize>) -> Self {
        let cores = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        Self::of(cores, device, network)
    }

    fn of(cores: NonZeroUsize, device: Device, network: Option<NonZeroUsize>) -> Self {
        let network = network.unwrap_or(match device {
            Device::Cpu => cores,
            // The processor only hands over and takes back.
            Device::Cuda(_) | Device::TensorRt(_) => NonZeroUsize::MIN,
        });
        Self {
            frame_workers: FRAME_WORKERS,
            remapping: cores,
            network,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(count: usize) -> NonZeroUsize {
        NonZeroUsize::new(count).unwrap()
    }

    #[test]
    fn the_network_gets_the_cores_unless_somebody_says_otherwise_or_it_is_elsewhere() {
        let network = |device, wanted| ThreadPlan::of(count(8), device, wanted).network.get();
        assert_eq!(network(Device::Cpu, None), 8);
        assert_eq!(network(Device::Cpu, Some(count(3))), 3);
        assert_eq!(network(Device::Cuda(0), None), 1);
        assert_eq!(network(Device::TensorRt(0), Some(count(2))), 2);
    }

    #[test]
    fn one_core_is_enough() {
        let plan = ThreadPlan::of(count(1), Device::Cpu, None);
        assert_eq!((plan.network.get(), plan.remapping.get()), (1, 1));
    }
}
