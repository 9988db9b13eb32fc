//! Rest: no target, the joints stay where they are.

motion![];
