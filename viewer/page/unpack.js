// Reads the bytes of a recording: ../src/pack.rs says what they are.

const NUMBERS = 10;

/** The bytes behind Base64 and raw deflate. */
export async function inflated(text) {
    const binary = atob(text.trim());
    const bytes = Uint8Array.from(binary, (character) => character.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** The rows of so many looks, and the lists of a recording or of a part of one; times in seconds, angles in
 * degrees, places in metres. */
export function unpack(bytes, about, looks) {
    let place = 0;
    const number = () => {
        let value = 0;
        let weight = 1;
        for (;;) {
            const byte = bytes[place++];
            value += (byte & 0x7f) * weight;
            if (byte < 0x80) return value;
            weight *= 0x80;
        }
    };
    const signed = () => {
        const value = number();
        return value % 2 ? -(value + 1) / 2 : value / 2;
    };
    const list = (item) => Array.from({ length: number() }, item);
    /** Reads a time that is counted from the one before. */
    const clock = (unit) => {
        let now = 0;
        return () => (now += number()) * unit;
    };
    const [position, turn, angle] = about.units;
    const units = [position, position, position]
        .map((unit) => unit / 1000)
        .concat(Array(4).fill(turn), Array(3).fill(angle));
    // Look by look, module by module, number by number.
    const placings = new Float32Array(looks * about.modules * NUMBERS);
    for (let module = 0; module < about.modules; module++) {
        for (let row = 0; row < NUMBERS; row++) {
            let value = 0;
            for (let look = 0; look < looks; look++) {
                value += signed();
                placings[(look * about.modules + module) * NUMBERS + row] = value * units[row];
            }
        }
    }
    const face = () => {
        const value = number();
        return { module: Math.floor(value / 6), dock: value % 6 };
    };
    const sent = clock(1e-6);
    const hormones = list(() => {
        const passage = { sent: sent(), from: face(), letter: number(), arrived: null };
        const took = number();
        if (took) passage.arrived = passage.sent + (took - 1) * 1e-6;
        return passage;
    });
    const done = clock(1e-6);
    const deeds = list(() => {
        const deed = { at: done(), module: number() };
        [deed.what, deed.of] = about.codes[number()];
        return deed;
    });
    const seen = clock(about.every);
    const views = list(() => ({
        at: seen(),
        module: number(),
        docks: number(),
        type: about.types[number() - 1],
    }));
    const lost = clock(about.every);
    const losses = list(() => ({ at: lost(), from: face(), frames: number() }));
    if (place !== bytes.length) throw new Error("the recording is not whole");
    return { placings, hormones, deeds, views, losses };
}
