//! Declaration of enums whose variants have words.

/// Declares an enum without data, whose variants are followed by their words. Each word has a
/// method that returns it, named after the enum.
///
/// Adds `EACH`, every variant in order, and `WORDS`, the first word of each.
macro_rules! worded {
    (
        $(#[$meta:meta])*
        pub enum $name:ident: $($method:ident),+ {
            $($(#[$doc:meta])* $variant:ident = $word:literal $(, $more:literal)*;)*
        }
    ) => {
        $(#[$meta])*
        pub enum $name {
            $($(#[$doc])* $variant,)*
        }

        impl $name {
            /// Every variant, in order.
            #[doc(hidden)]
            pub const EACH: [Self; [$($word),*].len()] = [$(Self::$variant),*];

            /// First word of every variant, in order.
            #[doc(hidden)]
            pub const WORDS: [&'static str; Self::EACH.len()] = [$($word),*];
        }

        worded!(@ $name [$($method)+] $({ $variant $word $($more)* })*);
    };
    (@ $name:ident [$method:ident $($others:ident)*] $({ $variant:ident $word:literal $($more:literal)* })*) => {
        impl $name {
            #[doc = concat!("Returns the `", stringify!($method), "` of the variant.")]
            #[doc(hidden)]
            pub const fn $method(self) -> &'static str {
                match self {
                    $(Self::$variant => $word,)*
                }
            }
        }

        worded!(@ $name [$($others)*] $({ $variant $($more)* })*);
    };
    (@ $name:ident [] $({ $variant:ident })*) => {};
}
