// Joins a canvas of the workbench to its page: hands it its specification, and hands on what a person does.
export default {
  template: "<div></div>",
  props: { drawing: String, spec: Object },
  mounted() {
    this.made = new window.elusive.made[this.drawing](this.$el, this.spec, (name, detail) => this.$emit(name, detail));
    this.$el.made = this.made;
  },
  unmounted() { this.made.destroy(); },
  watch: { spec(spec) { this.made.update(spec); } },
};
