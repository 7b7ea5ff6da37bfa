// Joins a drawing to its page of the workbench: fetches what it is told, draws it, and hands on what a person does.
const fetched = async (url) => {
  const answer = await fetch(url);
  if (!answer.ok) throw new Error("gone");
  return answer;
};
// what ends a press, and with it the wait of a redraw: that would take what is pressed from under the pointer
const released = () =>
  new Promise((go) => {
    const ended = () => setTimeout(go); // after the click, which follows in the same task
    for (const name of ["pointerup", "pointercancel", "blur"]) window.addEventListener(name, ended, { once: true });
  });
export default {
  template: "<div></div>",
  props: { spec: Object, live: String },
  mounted() {
    this.$el.addEventListener("pointerdown", ({ button }) => {
      if (!button) this.pressed = released();
    });
    if (this.live) this.made = new window.elusive.Live(this.$el, this.live, (name, detail) => this.$emit(name, detail));
    else this.show();
  },
  unmounted() {
    this.made?.destroy();
  },
  watch: {
    spec() {
      this.show();
    },
  },
  methods: {
    async show() {
      const asked = this.spec;
      if (!this.made) this.$el.textContent = "The frames are coming ...";
      try {
        const spec = asked.url ? await (await fetched(asked.url)).json() : JSON.parse(JSON.stringify(asked));
        const bytes = async ({ url }) => new Uint8Array(await (await fetched(url)).arrayBuffer());
        spec.blocks = await Promise.all(spec.blocks.map(bytes));
        await this.pressed;
        if (asked !== this.spec) return;
        if (this.made) this.made.update(spec);
        else this.made = new window.elusive.Figure(this.$el, spec, (name, detail) => this.$emit(name, detail));
      } catch {
        this.$el.textContent = "These frames are no longer held; run this again.";
      }
    },
  },
};
