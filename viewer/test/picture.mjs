// Makes the pictures of the README and of the gallery, or holds them against what they would be now.
// node picture.mjs [--check]

import { readFileSync, writeFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { Browser } from "./browser.mjs";
import { recorded } from "./pages.mjs";

const ROOT = fileURLToPath(new URL("../../", import.meta.url));
const LOOK = "&view=head&theme=dark&ui=off&smooth";

/** A centipede a while after a beat, when its hormones have come to the end. */
export const README = {
    file: "docs/robot.png",
    run: ["--modules", "18", "--seconds", "4.2"],
    address: `#t=4.1${LOOK}`,
    size: [1280, 560],
};

const gait = (name, seconds) => ({
    file: `docs/gaits/${name}.png`,
    run: [`${ROOT}robots/gaits/${name}.toml`, "--seconds", String(seconds)],
    address: `#t=${seconds - 0.1}${LOOK}`,
    size: [640, 320],
});

/** Each gait in the middle of a step. */
export const GALLERY = [
    gait("caterpillar", 3.5),
    gait("serpentine", 3.5),
    gait("rolling-track", 4.6),
    gait("butterfly-stroke", 3.8),
    gait("four-legs", 4),
    gait("six-legs", 4),
    gait("human", 4),
    gait("single", 3.5),
];

/** The share of the pixels that may differ: some millimetres, and another way to smooth edges. */
export const MOST = 0.03;

/** The picture as it is now, as a PNG. */
export async function taken({ file, run, address, size: [width, height] }, browser) {
    const { page } = recorded(file.replaceAll("/", "-"), ...run);
    await browser.resize(width, height);
    await browser.open(page, address);
    await browser.drawn();
    return browser.picture();
}

/** The share of the pixels that differ by more than 48 of 255 in a colour, between the picture and now. */
export async function changed(picture, browser) {
    const pictures = [await taken(picture, browser), readFileSync(ROOT + picture.file)];
    await browser.blank();
    return browser.run(
        `
        const [one, other] = await Promise.all(arguments[0].map(async (base64) => {
            const image = new Image();
            image.src = "data:image/png;base64," + base64;
            await image.decode();
            const canvas = new OffscreenCanvas(image.width, image.height);
            const context = canvas.getContext("2d");
            context.drawImage(image, 0, 0);
            return context.getImageData(0, 0, image.width, image.height);
        }));
        if (one.width !== other.width || one.height !== other.height) return 1;
        let differ = 0;
        for (let at = 0; at < one.data.length; at += 4) {
            differ += [0, 1, 2].some((part) => Math.abs(one.data[at + part] - other.data[at + part]) > 48);
        }
        return (4 * differ) / one.data.length;`,
        pictures.map((png) => png.toString("base64")),
    );
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
    const browser = await Browser.start();
    try {
        for (const picture of [README, ...GALLERY]) {
            if (process.argv[2] !== "--check") {
                writeFileSync(ROOT + picture.file, await taken(picture, browser));
                continue;
            }
            const share = await changed(picture, browser);
            console.log(`${picture.file}: ${(100 * share).toFixed(1)} % of its pixels differ`);
            if (share > MOST) process.exitCode = 1;
        }
    } finally {
        await browser.end();
    }
}
