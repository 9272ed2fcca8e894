//! Notifications to systemd: ready, stopping, and the watchdog of the service.
//!
//! systemd names its socket in `NOTIFY_SOCKET`, and the interval of the watchdog in
//! `WATCHDOG_USEC`. Without these variables nothing is sent.

use std::time::Duration;

use lookdown_http::Shutdown;
use sd_notify::NotifyState;
use tokio::{
    join,
    task::spawn_blocking,
    time::{MissedTickBehavior, interval},
};

use crate::api::{Phase, Readiness};

/// Notifies systemd when the server is ready and when a stop is requested. Confirms the watchdog at
/// half of its interval while `is_stuck` returns false. A blocked runtime confirms nothing. In both
/// cases systemd restarts the server.
pub(super) async fn notify(
    readiness: &Readiness,
    shutdown: &Shutdown,
    is_stuck: impl Fn() -> bool,
) {
    let phases = async {
        readiness.ready().await;
        if readiness.phase() == Phase::Ready {
            send(NotifyState::Ready).await;
        }
        shutdown.requested().await;
        send(NotifyState::Stopping).await;
    };
    let watchdog = async {
        let timeout = sd_notify::watchdog_enabled();
        if let Some(timeout) = timeout.filter(|timeout| !timeout.is_zero()) {
            let confirm = async || send(NotifyState::Watchdog).await;
            confirm_every(timeout / 2, is_stuck, confirm).await;
        }
    };
    join!(phases, watchdog);
}

/// Confirms at this interval, except while `is_stuck` returns true.
async fn confirm_every(every: Duration, is_stuck: impl Fn() -> bool, confirm: impl AsyncFn()) -> ! {
    let mut ticks = interval(every);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        ticks.tick().await;
        if !is_stuck() {
            confirm().await;
        }
    }
}

/// Sends a message. A failure is logged: systemd then acts on the missing message.
async fn send(state: NotifyState<'static>) {
    let sent = spawn_blocking(move || sd_notify::notify(&[state])).await;
    if let Ok(Err(error)) = sent {
        tracing::warn!(%error, "systemd cannot be notified");
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use tokio::time::timeout;

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn watchdog_is_confirmed_only_while_work_progresses() {
        let (stuck, confirmed) = (Cell::new(false), Cell::new(0));
        let for_three_ticks = async || {
            let confirm = async || confirmed.set(confirmed.get() + 1);
            let confirming = confirm_every(Duration::from_secs(5), || stuck.get(), confirm);
            let _ = timeout(Duration::from_secs(14), confirming).await;
        };
        for_three_ticks().await;
        assert_eq!(confirmed.get(), 3);
        stuck.set(true);
        for_three_ticks().await;
        assert_eq!(confirmed.get(), 3);
    }
}
