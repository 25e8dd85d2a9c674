// The 3D view, in parts: one file a thing that is drawn with.

export { Stage } from "./stage.js";
