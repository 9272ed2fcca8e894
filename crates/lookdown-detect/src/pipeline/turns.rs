//! Positions in a queue: by priority, then by the turns of the clients, then by arrival.
//!
//! Within a priority, clients take turns in proportion to the cost of their entries: start-time
//! fair queueing (Goyal, Vin and Cheng, 1996) with equal weights. An entry starts, in virtual time,
//! when the previous entry of its client ends, but not before now. Entries leave in the order of
//! their starts. Virtual time advances by the cost of what leaves, divided among the active
//! clients. So a client with many entries delays another client by one entry each round only, and
//! an idle client saves up nothing.

use std::collections::HashMap;

use crate::{fairness::Client, parameters::Priority};

/// Virtual time of a cost of 1. Shares of it are rounded down.
const UNIT: u64 = 1 << 20;
/// Most clients among which a cost is divided, so that virtual time always advances.
const MAX_CLIENTS: u64 = 256;

/// A position in a queue.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Turn {
    priority: Priority,
    /// The start in virtual time.
    start: u64,
    arrival: u64,
    cost: u64,
    client: Client,
}

/// Assigns positions in a queue. A client is forgotten when its last entry has ended in virtual
/// time.
#[derive(Debug, Default)]
pub(super) struct Turns {
    arrivals: u64,
    lanes: [Lane; 3],
}

/// The clients of one priority.
#[derive(Debug, Default)]
struct Lane {
    now: u64,
    flows: HashMap<Client, Flow>,
}

/// The entries of one client in a lane.
#[derive(Debug, Default)]
struct Flow {
    /// The end of its last entry in virtual time.
    end: u64,
    waiting: usize,
}

impl Turns {
    /// Assigns the position of a new entry.
    pub(super) fn next(&mut self, priority: Priority, client: &Client, cost: usize) -> Turn {
        self.arrivals += 1;
        let arrival = self.arrivals;
        let cost = u64::try_from(cost).unwrap_or(u64::MAX).saturating_mul(UNIT);
        let lane = self.lane(priority);
        let flow = lane.flows.entry(client.clone()).or_default();
        let start = flow.end.max(lane.now);
        flow.end = start.saturating_add(cost);
        flow.waiting += 1;
        Turn {
            priority,
            start,
            arrival,
            cost,
            client: client.clone(),
        }
    }

    /// Records that an entry has left the queue. An entry that was withdrawn counts as served.
    pub(super) fn end(&mut self, turn: &Turn) {
        let lane = self.lane(turn.priority);
        // Includes clients without waiting entries whose last one has not ended in virtual time.
        let clients = u64::try_from(lane.flows.len()).unwrap_or(u64::MAX);
        let clients = clients.clamp(1, MAX_CLIENTS);
        lane.now = (lane.now.saturating_add(turn.cost / clients)).max(turn.start);
        if let Some(flow) = lane.flows.get_mut(&turn.client) {
            flow.waiting = flow.waiting.saturating_sub(1);
        }
        let now = lane.now;
        lane.flows
            .retain(|_, flow| flow.waiting > 0 || flow.end > now);
    }

    fn lane(&mut self, priority: Priority) -> &mut Lane {
        &mut self.lanes[priority as usize]
    }
}

#[cfg(test)]
mod tests;
