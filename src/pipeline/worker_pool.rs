//! Worker threads that take frames from a bounded queue.

use std::{
    num::NonZeroUsize,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Arc, Mutex, PoisonError},
    thread::JoinHandle,
};

use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc, oneshot};

use super::{DetectJob, Detected, Engine, PipelineError, error::internal};

type Answer = Result<Detected, PipelineError>;

/// A frame in the queue with the way back to whoever waits for it.
struct Ticket {
    job: DetectJob,
    answer: oneshot::Sender<Answer>,
    /// Travels with the work: a place is free again when the work has ended, not when its client
    /// has left.
    place: OwnedSemaphorePermit,
}

/// Named threads that run the engine on a bounded number of frames.
pub struct WorkerPool {
    engine: Arc<Engine>,
    queue: Mutex<Option<mpsc::Sender<Ticket>>>,
    places: Arc<Semaphore>,
    capacity: NonZeroUsize,
    threads: Mutex<Vec<JoinHandle<()>>>,
}

impl WorkerPool {
    /// Starts `workers` threads; `capacity` frames may wait or be worked on.
    ///
    /// # Errors
    /// When the operating system gives no thread.
    pub fn start(
        engine: &Arc<Engine>,
        workers: NonZeroUsize,
        capacity: NonZeroUsize,
    ) -> std::io::Result<Self> {
        let (queue, tickets) = mpsc::channel(capacity.get());
        let tickets = Arc::new(Mutex::new(tickets));
        let threads = (0..workers.get()).map(|index| {
            let (engine, tickets) = (Arc::clone(engine), Arc::clone(&tickets));
            std::thread::Builder::new()
                .name(format!("frame-worker-{index}"))
                .spawn(move || work(&engine, &tickets))
        });
        Ok(Self {
            engine: Arc::clone(engine),
            threads: Mutex::new(threads.collect::<Result<_, _>>()?),
            queue: Mutex::new(Some(queue)),
            places: Arc::new(Semaphore::new(capacity.get())),
            capacity,
        })
    }

    /// The engine that works.
    #[must_use]
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// Queues a frame and waits for its report. Dropping the future withdraws a frame that no
    /// worker has begun.
    ///
    /// # Errors
    /// [`PipelineError::Overloaded`] at once when the queue is full,
    /// [`PipelineError::ShuttingDown`] after [`WorkerPool::shut_down`], otherwise what the engine
    /// says.
    pub async fn detect(&self, job: DetectJob) -> Result<Detected, PipelineError> {
        let place = Arc::clone(&self.places).try_acquire_owned().map_err(|_| {
            PipelineError::Overloaded {
                capacity: self.capacity.get(),
            }
        })?;
        let (answer, waiting) = oneshot::channel();
        self.enqueue(Ticket { job, answer, place })?;
        waiting
            .await
            .unwrap_or_else(|_| Err(internal(anyhow::anyhow!("a worker died on a frame"))))
    }

    /// How many frames wait or are worked on.
    #[must_use]
    pub fn pending(&self) -> usize {
        self.capacity.get() - self.places.available_permits()
    }

    /// Takes no more frames, finishes those in the queue and ends the threads. Blocks.
    pub fn shut_down(&self) {
        drop(
            self.queue
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .take(),
        );
        let mut threads = self.threads.lock().unwrap_or_else(PoisonError::into_inner);
        for thread in threads.drain(..) {
            // A worker that panicked outside a job has nothing left to tell.
            let _ = thread.join();
        }
    }

    fn enqueue(&self, ticket: Ticket) -> Result<(), PipelineError> {
        let queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
        let queue = queue.as_ref().ok_or(PipelineError::ShuttingDown)?;
        // The channel has as many places as there are permits, so it cannot be full.
        queue
            .try_send(ticket)
            .map_err(|_| PipelineError::ShuttingDown)
    }
}

fn work(engine: &Engine, tickets: &Mutex<mpsc::Receiver<Ticket>>) {
    loop {
        let next = tickets
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .blocking_recv();
        let Some(Ticket { job, answer, place }) = next else {
            return;
        };
        if answer.is_closed() {
            // Its client has left: nobody would read the report.
            continue;
        }
        let outcome = catch_unwind(AssertUnwindSafe(|| engine.detect(&job)))
            .unwrap_or_else(|_| Err(internal(anyhow::anyhow!("a worker panicked on a frame"))));
        // Whoever sends the next frame on this answer must find the place free.
        drop((job, place));
        // The client may have left meanwhile.
        let _ = answer.send(outcome);
    }
}

#[cfg(test)]
mod tests;
