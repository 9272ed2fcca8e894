mod accuracy;
mod lenses;
mod sampling;
mod views;
