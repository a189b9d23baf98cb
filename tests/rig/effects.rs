//! Results that can be checked by hand.
