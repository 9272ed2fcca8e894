//! The switch for detection of each camera of `lookdown run`: its state, its announcement, and the
//! commands that pause and resume the camera.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
    time::Duration,
};

use lookdown_common::LogOnce;
use rumqttc::Publish;
use tokio::{
    task::{JoinHandle, spawn_blocking},
    time::{Instant, timeout},
};

use super::{
    discovery::{Discovery, RetainedTopics},
    occupancy::{OFF, ON},
    session::Message,
    topics::{Topics, level},
};
use crate::cameras::{CameraError, Cameras};

/// Most commands that wait for cameras that are not known yet.
const MAX_COMMANDS: usize = 256;

/// Longest wait for the files of the cameras, which may hang: the reports wait as long.
const FILES_TIMEOUT: Duration = Duration::from_secs(1);

/// The execution of commands, which uses the files of the cameras.
struct Execution {
    commands: BTreeMap<String, bool>,
    /// Returns the states of all cameras.
    task: JoinHandle<Result<BTreeMap<String, bool>, CameraError>>,
}

/// The switches of all cameras of this process.
pub(super) struct Switches {
    topics: Topics,
    discovery: Discovery,
    cameras: Arc<Cameras>,
    /// The published states by camera.
    published: BTreeMap<String, bool>,
    /// The latest command for each camera, by the level of its topic.
    commands: BTreeMap<String, bool>,
    /// The execution that waits for files that hang.
    waiting: Option<Execution>,
    retained: RetainedTopics,
    /// The time at which the switches of `retained` are withdrawn.
    withdraw_at: Option<Instant>,
    log: LogOnce,
}

impl Switches {
    pub(super) fn new(topics: Topics, discovery: Discovery, cameras: Arc<Cameras>) -> Self {
        Self {
            topics,
            discovery,
            cameras,
            published: BTreeMap::new(),
            commands: BTreeMap::new(),
            waiting: None,
            retained: RetainedTopics::default(),
            withdraw_at: None,
            log: LogOnce::default(),
        }
    }

    /// Begins a connection. Switches that the broker has retained, but no server publishes for
    /// `unknown_for`, are withdrawn.
    pub(super) fn begin_connection(&mut self, now: Instant, unknown_for: Duration) {
        self.published.clear();
        self.retained = RetainedTopics::default();
        self.withdraw_at = Some(now + unknown_for);
    }

    /// Publishes everything again with the next update.
    pub(super) fn publish_again(&mut self) {
        self.published.clear();
    }

    /// Notes a command or a state. Returns false for a message of another topic. A retained command
    /// is ignored: it would override what was chosen in the web page. The cameras of the settings
    /// are known some seconds after the start, so commands of unknown cameras wait.
    pub(super) fn note(&mut self, message: &Publish) -> bool {
        let Some((camera, is_command)) = self.topics.switch_topic(&message.topic) else {
            return false;
        };
        let is_retained = message.retain && !message.payload.is_empty();
        if is_command && !message.retain {
            let is_known = self.published.keys().any(|name| level(name) == camera);
            let may_wait = self.withdraw_at.is_some() && self.commands.len() < MAX_COMMANDS;
            let wanted = [(ON, true), (OFF, false)]
                .into_iter()
                .find_map(|(payload, is_on)| (message.payload == payload).then_some(is_on));
            if let (true, Some(is_on)) = (is_known || may_wait, wanted) {
                self.commands.insert(camera.to_owned(), is_on);
            }
        } else if !is_command && is_retained {
            self.retained.note(camera, None);
        } else if !is_command {
            // It was removed, another server has this camera, or it is an echo.
            self.retained.keep(camera);
        }
        true
    }

    /// Executes the commands and returns the messages for everything that has changed. It is called
    /// at intervals, so that commands cost no more than one write per camera and interval.
    pub(super) async fn update(&mut self, now: Instant) -> Vec<Message> {
        let mut execution = match self.waiting.take() {
            Some(waiting) if !waiting.task.is_finished() => {
                self.waiting = Some(waiting);
                return Vec::new();
            }
            Some(done) => done,
            None => self.execute(),
        };
        let Ok(done) = timeout(FILES_TIMEOUT, &mut execution.task).await else {
            tracing::warn!("the switches of cameras wait for the files in state.path");
            self.waiting = Some(execution);
            return Vec::new();
        };
        let states = match done {
            Ok(Ok(states)) => {
                self.log.clear();
                states
            }
            Ok(Err(problem)) => {
                if self.log.should_log(&problem.to_string()) {
                    tracing::warn!("the switches of cameras are not published: {problem}");
                }
                return Vec::new();
            }
            // A panic was already logged.
            Err(_) => return Vec::new(),
        };
        let mut messages = self.changes(&states);
        self.published = states;
        let levels: BTreeSet<_> = self.published.keys().map(|name| level(name)).collect();
        let is_waiting = self.withdraw_at.is_some();
        // A command that arrived meanwhile stays.
        self.commands.retain(|camera, wanted| {
            execution.commands.get(camera) != Some(wanted) || is_waiting && !levels.contains(camera)
        });
        if self.withdraw_at.is_some_and(|at| at <= now) {
            self.withdraw_at = None;
            for (unknown, _) in self.retained.take() {
                if !levels.contains(&unknown) {
                    messages.extend(self.withdrawal(&unknown));
                }
            }
        }
        messages
    }

    /// Begins the execution of the commands.
    fn execute(&self) -> Execution {
        let commands = self.commands.clone();
        let cameras = Arc::clone(&self.cameras);
        let task = spawn_blocking({
            let commands = commands.clone();
            move || {
                let mut states = cameras.detection()?;
                for (name, is_on) in &mut states {
                    let wanted = commands.get(&level(name)).copied();
                    if let Some(wanted) = wanted.filter(|wanted| wanted != is_on) {
                        cameras.set_detection(name, wanted)?;
                        tracing::info!(camera = name, "detection is {}", payload(wanted));
                        *is_on = wanted;
                    }
                }
                Ok(states)
            }
        });
        Execution { commands, task }
    }

    fn changes(&self, states: &BTreeMap<String, bool>) -> Vec<Message> {
        let mut messages = Vec::new();
        for name in self.published.keys() {
            if !states.contains_key(name) {
                messages.extend(self.withdrawal(name));
            }
        }
        for (name, is_on) in states {
            let before = self.published.get(name);
            if before.is_none() {
                messages.extend(self.discovery.switch(&self.topics, name));
            }
            if before != Some(is_on) {
                let topic = self.topics.of_camera(name, "detection");
                messages.push(Message::retained(topic, payload(*is_on)));
            }
        }
        messages
    }

    fn withdrawal(&self, camera: &str) -> Vec<Message> {
        let mut messages = vec![Message::forget(self.topics.of_camera(camera, "detection"))];
        messages.extend(Discovery::switch_withdrawal(&self.topics, camera));
        messages
    }
}

fn payload(is_on: bool) -> &'static str {
    if is_on { ON } else { OFF }
}

#[cfg(test)]
mod tests;
