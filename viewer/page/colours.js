// The colours of all that has one.

const TYPES = {
    Head: "#ff6a4d",
    Tail: "#b58cff",
    LeftLeg: "#37d39b",
    RightLeg: "#25b9d6",
    Spine: "#4c8dff",
    Branch: "#ffc247",
    Alone: "#ff7fc2",
    Other: "#a8b3c2",
};
const STARTING = "#5d6775";
const LETTERS = ["#fff1a8", "#ff9df0", "#9dfff0", "#b6ff9d", "#ffc89d", "#c3b6ff"];

/** By theme, what the picture is made of. */
export const THEMES = {
    dark: {
        sky: "#0c1118",
        ground: "#1b2431",
        line: "#2b3748",
        strong: "#43546d",
        hub: "#566173",
        block: "#4a5668",
        held: "#7ee8c0",
        unknown: "#6b7787",
        lost: "#ff5c52",
        sun: 3.1,
        fill: 1.5,
        text: "#93a1b3",
        still: "#202a38",
        path: "#6cb6ff",
    },
    light: {
        sky: "#eef1f5",
        ground: "#e3e8ee",
        line: "#cbd3dd",
        strong: "#a9b5c4",
        hub: "#69737f",
        block: "#a3aebb",
        held: "#0d9a68",
        unknown: "#8a95a3",
        lost: "#d92d20",
        sun: 3.0,
        fill: 1.7,
        text: "#546274",
        still: "#d4dbe4",
        path: "#0a62c4",
    },
};

export const ofType = (name) => TYPES[name] ?? STARTING;
export const ofLetter = (letter) => LETTERS[letter % LETTERS.length];

/** What joints do while they bear or rest is dim, and what moves is bright. */
const DIM = new Set(["Straight", "Holding", "HoldingOver", "Rest", "none yet"]);
export const isBright = (action) => !DIM.has(action);
