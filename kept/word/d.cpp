#include <chrono>
#include "drv.hpp"
#include "tests/support/omissions.hpp"
void setrate(Scene& s,const Structure& S,double per=0.4){s.rate=std::clamp(S.omega.maxCoeff()/per,20*lowest_of(S)/6.28,20000.0);}
std::string S(double x){char b[40];std::snprintf(b,40,"%.4g",x);return b;}
double size_of(const Structure& s){return s.mass_properties.r.colwise().norm().maxCoeff();}
Scene cloud(int n,unsigned seed,double lo=1e3,double hi=1e4){std::mt19937_64 g(seed);std::uniform_real_distribution<double>u(-1,1);Scene s;s.name="cl";
  while((int)s.points.size()<n){Vector3d p(1.5*u(g),0.8*u(g),0.6*u(g));bool ok=true;for(auto&q:s.points)ok=ok&&(q.position-p).norm()>0.6;if(ok)point(s,std::exp(0.7*u(g)),p);}
  for(int a=0;a<n;++a)for(int b=a+1;b<n;++b)link(s,{a,b},Spring{std::exp(0.5*(std::log(lo)+std::log(hi))+0.5*u(g)*std::log(hi/lo))});publish_all(s);return s;}
TEST(D,hinge){for(double amp:{1e-5,1e-4,1e-3})for(int sh:{0,1}){Scene s;s.name="h";
    for(int i=0;i<5;++i)point(s,1+0.3*i,Vector3d(i,sh?0:(i==2?0.1:0),sh?0:0.05*i*i));
    for(int i=0;i<4;++i){Beam b{.EA=3e4,.GJ=200,.EI_y=300,.EI_z=400,.y_axis=Vector3d(0.1,0.2,1)};if(sh)b.y_axis={0,1,0};if(i==1)b.released[1]={false,true,false};link(s,{i,i+1},b);}
    publish_all(s);auto S_=st(s);int a=S_->mechanisms.size();double w1=lowest_of(*S_);setrate(s,*S_);
    add_mode(s,*S_,a,amp,0);
    study("hinge amp"+S(amp)+(sh?" straight":" bent"),s,(amp<5e-5?60:20)*2*M_PI/w1,{Fidelity::kSeparated,Fidelity::kCoupled},25);}}
// springs only: two triangles (tetrahedra) joined by two points: a hinge line
TEST(D,hinge_springs){for(double amp:{1e-5,1e-4,1e-3}){Scene s;s.name="hs";
    point(s,1,{0,0,0.1});point(s,1.2,{0,1,-0.1});point(s,1,{1,0.4,0.3});point(s,1.3,{-1,0.6,0.2});point(s,0.8,{1.1,0.7,-0.4});point(s,0.9,{-0.9,0.2,-0.5});
    auto j=[&](int a,int b){link(s,{a,b},Spring{1000.0+100*a+70*b});};
    j(0,1);for(int k:{2,3,4,5}){j(0,k);j(1,k);}j(2,4);j(3,5);publish_all(s);
    auto S_=st(s);int a=S_->mechanisms.size();double w1=lowest_of(*S_);setrate(s,*S_);std::printf("mech %d\n",a);
    add_mode(s,*S_,a,amp,0);add_mode(s,*S_,a+1,amp,0);
    study("hinge springs amp"+S(amp),s,(amp<5e-5?100:20)*2*M_PI/w1,{Fidelity::kSeparated,Fidelity::kCoupled,Fidelity::kExactBars},25);}}
TEST(D,local){for(double F:{0.0,0.01,0.04})for(double q0:{2e-6}){Scene s;s.name="local";
    std::mt19937_64 g(3);std::uniform_real_distribution<double>u(-1,1);
    while((int)s.points.size()<19){Vector3d p(3*u(g),3*u(g),3*u(g));bool ok=true;for(auto&q:s.points)ok=ok&&(q.position-p).norm()>0.9;if(ok)point(s,5,p);}
    for(int a=0;a<19;++a)for(int b=a+1;b<19;++b)link(s,{a,b},Spring{100*std::exp(u(g))});
    int A=0,B=1;Vector3d pa=s.points[A].position,pb=s.points[B].position;
    int m1=point(s,0.05,0.5*(pa+pb));double Ls=(pb-pa).norm();
    link(s,{A,m1},Spring{1e5});link(s,{m1,B},Spring{1e5});link(s,{A,m1,B},BendingSpring{40});publish_all(s);
    auto S_=st(s);int nm=S_->omega.size();Vector3d ax=(pb-pa).normalized();
    int lm=-1;double best=0;for(int q=0;q<nm;++q){auto b=S_->shapes.block<3,1>(3*m1,q);double tr=(b-ax*ax.dot(b)).norm();if(tr>best){best=tr;lm=q;}}
    setrate(s,*S_,0.8);add_mode(s,*S_,lm,q0,0);Load L;L.axes=Axes::kBody;double Fc=F*4*40/Ls;L.forces={{A,Fc*ax},{B,-Fc*ax}};if(F>0)s.loads={L};
    for(int q=0;q<nm&&F>0;++q){double x=Fc*ax.dot(S_->shapes.block<3,1>(3*A,q)-S_->shapes.block<3,1>(3*B,q))/(S_->mass_properties.mass*S_->omega[q]*S_->omega[q]);add_mode(s,*S_,q,x,0);}
    s.tolerance=q0;
    study("local F"+S(F)+" q0 "+S(q0)+" mode "+S(lm)+" of "+S(nm),s,6*2*M_PI/S_->omega[lm],{Fidelity::kSeparated,Fidelity::kExactBars},20);}}
TEST(D,coarse){for(double per:{10.01,12.,20.,40.})for(int dir:{0,1}){Scene s=cloud(5,101);auto S_=st(s);double w1=lowest_of(*S_);
    double f=dir?1.0*w1/2/M_PI*0.6:w1/2/M_PI*0.9;s.rate=f*per;
    Load L;L.axes=Axes::kBody;L.forces={{0,1e-5*w1*w1*Vector3d(1,0.5,0.2)}};L.history=SineHistory{f,0};s.loads={L};
    study("coarse ticks/period "+S(per)+" "+S(dir),s,20*2*M_PI/w1,{Fidelity::kSeparated,Fidelity::kCoupled},25);}}
// coupled at a rate that does not resolve what vibrates
TEST(D,coarsecoupled){for(double per:{0.5,1.,2.,4.,8.})for(double w:{0.02,0.1}){Scene s=cloud(5,103);auto S_=st(s);double w1=lowest_of(*S_);
    s.rate=S_->omega.maxCoeff()/per;int last=S_->omega.size()-1;add_mode(s,*S_,last,1e-5,0);add_mode(s,*S_,last-1,1e-5,0);s.initial.angular_velocity=w*w1*Vector3d(0.3,0.5,0.8);
    s.tolerance=0;
    study("coarse coupled wh "+S(per)+" w "+S(w)+" rate "+S(s.rate),s,20*2*M_PI/w1,{Fidelity::kSpinLoaded,Fidelity::kCoupled,Fidelity::kExactBars},25);}}
// world load that bends alone, on a body near its unstable axis
TEST(D,worldracket){for(double w:{0.004,0.01})for(double V:{1e-3,4e-3}){Scene s;s.name="wr";
    for(int i=0;i<3;++i)point(s,1,Vector3d(i-1,0,0));point(s,0.6,{0,0.8,0.05});point(s,0.6,{0,-0.8,-0.05});point(s,0.02,{0.05,0.02,0.4});point(s,0.02,{0,0,-0.4});
    for(int a=0;a<7;++a)for(int b=a+1;b<7;++b)link(s,{a,b},Spring{1000.0+37*a+91*b});publish_all(s);s.damping.modal_ratio=0.1;
    auto S_=st(s);double w1=lowest_of(*S_);setrate(s,*S_,1.0);
    Eigen::Matrix3d J=Eigen::Matrix3d::Zero();const auto& r=S_->mass_properties.r;
    for(int i=0;i<r.cols();++i)J+=s.points[i].mass*(r.col(i).squaredNorm()*Eigen::Matrix3d::Identity()-r.col(i)*r.col(i).transpose());
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> es(J);s.initial.angular_velocity=w*w1*es.eigenvectors().col(1);
    Load L;L.axes=Axes::kWorld;double F=V*w1*w1*0.5;L.forces={{0,Vector3d(0.3,F,0.2*F)},{1,Vector3d(-0.6,-2*F,-0.4*F)},{2,Vector3d(0.3,F,0.2*F)}};for(auto&x:L.forces)x.force.x()=x.point==1?-F:0.5*F;s.loads={L};
    study("world racket w "+S(w)+" V "+S(V),s,30/(w*w1),{Fidelity::kSeparated,Fidelity::kSpinLoaded,Fidelity::kCoupled},30);}}
TEST(D,leaveout){
    Scene s;s.name="lo";s.rate=2000;point(s,1,{-2,0,0});point(s,1,{-1,0,0});point(s,4,{0,0,0});point(s,1,{1,0,0});point(s,1,{2,0,0});point(s,1,{0,0.5,0});
    Beam b{.EA=6.4e4,.GJ=560,.EI_y=750,.EI_z=750};for(int i=0;i<4;++i)link(s,{i,i+1},b);link(s,{2,5},b);
    double d[5]={1e-4,-1.5e-4,0,1.5e-4,-1e-4};for(int i=0;i<5;++i)s.initial.points.push_back({i,Vector3d(0,0,d[i]),Vector3d::Zero()});
    Load L;L.axes=Axes::kBody;L.forces={{2,Vector3d(0,0,0.2)}};L.history=PulseHistory{0.1,0.1};s.loads={L};
    s.leave_out.tolerance=0.02;s.publication.points={2};s.pushable={};
    Faults f;auto S_=build_structure(s,f);auto plan=make_plan(s,*S_,f);ASSERT_TRUE(plan);for(auto&x:f)std::printf("%s\n",x.message.c_str());
    std::printf("modes %d of %d\n",plan->num_elastic,(int)S_->omega.size());
    Simulation sim(*plan);Budget none;Judgement j(sim.plan);j.take(sim.state,none);
    auto t=checks(s,1.0,15);Scene whole=s;whole.leave_out={};publish_all(whole);auto tr=truth_run(whole,t);Eigen::VectorXd m;Eigen::Matrix3Xd r;masses(s,m,r);
    std::printf("truth %s\n",tr.error.c_str());
    // modes of the plan: those of the structure with the same frequency
    for(size_t k=0;k<tr.V.size();++k){auto tick=std::llround(t[k]*s.rate);while(sim.state.tick<tick){sim.run(1);j.take(sim.state,none);}
      Eigen::VectorXd V=Eigen::VectorXd::Zero(S_->shapes.rows());for(int q=0;q<plan->num_elastic;++q){int at=0;for(int x=0;x<S_->omega.size();++x)if(std::abs(S_->omega[x]-plan->omega[q])<std::abs(S_->omega[at]-plan->omega[q]))at=x;V+=sim.state.q[q]*S_->shapes.col(at);}
      Eigen::Matrix3Xd W=Eigen::Map<Eigen::Matrix3Xd>(V.data(),3,6);auto v=j.now();
      std::printf("t %.3f |V| %.3e truth %.3e err/scale %.3f est %.2e %s\n",t[k],mean_size(W,m),mean_size(tr.V[k],m),mean_size(W-tr.V[k],m)/std::max(v.scale,mean_size(tr.V[k],m)),v.error/v.scale,describe(sim.plan,v).c_str());}
}
TEST(Z,tally){std::printf("TALLY scenes %d runs %d runs with false %d words %d good %d false %d silly runs %d\n",tally.scenes,tally.runs,tally.runs_fg,tally.words,tally.good,tally.false_good,tally.silly);}
