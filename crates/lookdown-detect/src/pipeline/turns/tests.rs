#![expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "ticks and counts of a simulation are small"
)]

use std::collections::BTreeMap;

use super::*;
use crate::fairness::{BudgetShare, SharedBudget};

/// Ticks that one frame takes.
const SERVICE: u64 = 1000;
/// Ticks of a simulation.
const DURATION: u64 = 20_000 * SERVICE;
/// Clients beside the one that may be greedy. Each sends at 0.9 times its share.
const OTHERS: u64 = 4;
const CAPACITY: usize = 32;

/// The outcome of the clients that are not greedy.
struct Outcome {
    served: usize,
    refused: usize,
    p99: u64,
}

/// Serves frames of all clients by turns, one after the other, in virtual time. The client 0 sends
/// at `greed` times its share. The pauses are from a fixed sequence with an exponential
/// distribution.
fn simulate(greed: f64) -> Outcome {
    let share = 1.0 / (OTHERS + 1) as f64;
    let mut seed = 1_u64;
    let mut arrivals = Vec::new();
    for client in 0..=OTHERS {
        let rate = if client == 0 { greed } else { 0.9 } * share / SERVICE as f64;
        let mut at = 0.0;
        while at < DURATION as f64 {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let random = ((seed >> 11) as f64 + 1.0) / (1_u64 << 53) as f64;
            at -= random.ln() / rate;
            arrivals.push((at as u64, client));
        }
    }
    arrivals.sort_unstable();
    let (budget, mut turns) = (SharedBudget::new(CAPACITY), Turns::default());
    let mut waiting: BTreeMap<Turn, (u64, u64, BudgetShare)> = BTreeMap::new();
    let (mut free_at, mut refused, mut times) = (0, 0, Vec::new());
    let mut serve = |until: u64, waiting: &mut BTreeMap<Turn, _>, turns: &mut Turns| {
        while let Some((turn, (arrival, client, place))) = waiting.pop_first() {
            let begin = u64::max(free_at, arrival);
            if begin > until {
                waiting.insert(turn, (arrival, client, place));
                return;
            }
            turns.end(&turn);
            free_at = begin + SERVICE;
            if client > 0 {
                times.push(free_at - arrival);
            }
        }
    };
    for (at, client) in arrivals {
        serve(at, &mut waiting, &mut turns);
        let sender = Client::with_key(&client.to_string());
        match budget.take(&sender, 1) {
            Ok(place) => {
                let turn = turns.next(Priority::Normal, &sender, 1);
                waiting.insert(turn, (at, client, place));
            }
            Err(_) if client > 0 => refused += 1,
            Err(_) => {}
        }
    }
    serve(u64::MAX, &mut waiting, &mut turns);
    times.sort_unstable();
    Outcome {
        served: times.len(),
        refused,
        p99: times[times.len() * 99 / 100],
    }
}

#[test]
fn a_greedy_client_hardly_slows_the_others() {
    let (fair, greedy) = (simulate(1.0), simulate(20.0));
    assert!(fair.served > 10_000, "{}", fair.served);
    let (before, after) = (fair.served as f64, greedy.served as f64);
    assert!(
        after >= 0.9 * before,
        "{before} → {after}, refused {}",
        greedy.refused
    );
    let (before, after) = (fair.p99 as f64, greedy.p99 as f64);
    assert!(after <= 1.5 * before, "p99 {before} → {after} ticks");
}

/// Serves frames by three workers. Four clients have one frame in flight each, and a fifth one has
/// `greedy` frames. Each sends its next frame just after a worker has taken another one. Returns
/// the share of the four clients.
fn share_of_others(greedy: usize) -> f64 {
    let clients: Vec<_> = (0..5)
        .map(|name| Client::with_key(&name.to_string()))
        .collect();
    let mut turns = Turns::default();
    let mut waiting = BTreeMap::new();
    let send = |client: usize, turns: &mut Turns, waiting: &mut BTreeMap<Turn, usize>| {
        waiting.insert(turns.next(Priority::Normal, &clients[client], 1), client);
    };
    for _ in 0..greedy {
        send(0, &mut turns, &mut waiting);
    }
    for client in 1..5 {
        send(client, &mut turns, &mut waiting);
    }
    let (mut workers, mut served) = ([None; 3], [0; 5]);
    for frame in 0..10_000 {
        let worker = &mut workers[frame % 3];
        let done = worker.take();
        let (turn, client) = waiting.pop_first().unwrap();
        turns.end(&turn);
        *worker = Some(client);
        served[client] += 1;
        if let Some(done) = done {
            send(done, &mut turns, &mut waiting);
        }
    }
    1.0 - f64::from(served[0]) / 10_000.0
}

#[test]
fn clients_with_one_frame_at_a_time_keep_their_share() {
    for greedy in [1, 8, 20] {
        let share = share_of_others(greedy);
        assert!(
            share >= 0.9 * 0.8,
            "{share} beside {greedy} frames in flight"
        );
    }
}

#[test]
fn costly_entries_use_up_turns_faster() {
    let mut turns = Turns::default();
    let (large, small) = (Client::with_key("large"), Client::with_key("small"));
    let entries = std::iter::repeat_n((&large, 4), 3).chain(std::iter::repeat_n((&small, 1), 9));
    let mut waiting: Vec<_> = entries
        .map(|(client, cost)| turns.next(Priority::Normal, client, cost))
        .collect();
    waiting.sort();
    let order: String = waiting
        .iter()
        .map(|turn| if turn.client == large { 'L' } else { 's' })
        .collect();
    assert_eq!(order, "LssssLssssLs");
}

#[test]
fn an_idle_client_saves_up_no_turns() {
    let mut turns = Turns::default();
    let (idle, busy) = (Client::with_key("idle"), Client::with_key("busy"));
    for _ in 0..100 {
        let turn = turns.next(Priority::Normal, &busy, 1);
        turns.end(&turn);
    }
    let mut waiting: Vec<_> = [&idle, &idle, &idle, &busy, &busy]
        .map(|client| turns.next(Priority::Normal, client, 1))
        .into();
    waiting.sort();
    let order: Vec<_> = waiting.iter().map(|turn| &turn.client).collect();
    assert_eq!(order, [&idle, &busy, &idle, &busy, &idle]);
}

#[test]
fn clients_that_have_left_are_forgotten() {
    let mut turns = Turns::default();
    let waits = turns.next(Priority::Normal, &Client::with_key("waits"), 1);
    for number in 0..10_000 {
        let client = Client::with_key(&number.to_string());
        let turn = turns.next(Priority::Normal, &client, 1);
        turns.end(&turn);
        assert!(turns.lanes[1].flows.len() <= 300);
    }
    turns.end(&waits);
}
