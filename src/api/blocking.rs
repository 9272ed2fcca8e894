//! Work that blocks, off the async runtime; what it logs is still the request's.

use tokio::task::spawn_blocking;

use super::problem::Problem;

/// Does work that blocks.
pub(super) async fn blocking<T: Send + 'static, E: Send + 'static>(
    work: impl FnOnce() -> Result<T, E> + Send + 'static,
) -> Result<T, Problem>
where
    Problem: From<E>,
{
    let request = tracing::Span::current();
    let work = move || request.in_scope(work);
    Ok(spawn_blocking(work).await.map_err(Problem::internal)??)
}
